"""Conditions that a log must meet before a fit, and the samples of it that count.

Refused, with file, time and value: a run that does not start at rest, a hole that hides too much, a
sampling too slow for the bench's spikes, a torque of the wrong sign, speeds of drum and
motor that do not belong to one gear, no motion. Left out with a note: samples that a channel only
repeats (frozen, slower than the log, at the end of its range).

A repeated value is suspicious only in a channel with noise (a simulated log rests exactly), and
only while another channel goes on changing (a bench at rest may show nothing but zeros). With q,
the share of samples of a channel that equal the one before, a run of L equal ones is expected
n q^L times; it counts as frozen where that is under CHANCE.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, log
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from plant_emulator.errors import LogError
from plant_emulator.signals.log import (
    VOLTAGE,
    Array,
    Log,
    compared_channels,
    has_truck,
    without_voltage,
)
from plant_emulator.signals.noise import FLOOR, noise
from register_maps.signals import LOG_COLUMNS

if TYPE_CHECKING:
    from collections.abc import Mapping

Use = NDArray[np.bool_]

CHANCE = 1e-6
SHORTEST_FROZEN = 5
SHORTEST_CLIPPED = 4
# Equal samples that no noise explains. The other samples show how many are equal by chance.
CERTAINLY_FROZEN = 50
# Share of the range above which a channel's noise is noise, not rounding.
NOISY = 2.0 * FLOOR
# A channel that repeats more than this share of its samples while it moves is sampled and held.
HELD_SHARE = 0.4
# The value of a held channel waits for the next task: a change after a change is rarer there than
# any change, by this factor. Noise that crosses a coarse quantum changes the value in bursts.
HELD_SPACING = 0.75
# More than this share of a channel left out, and the channel cannot be used.
USELESS_SHARE = 0.5
# A hole is bridged by the reference from both sides. A longer one hides too much of what the bench
# was asked to do [s].
LONGEST_HOLE = 2.0
# Sampling interval that still shows the backlash's spikes [s]: at 50 Hz fits find what they find at
# 100 Hz, at 25 Hz they misplace friction and gap by several standard errors.
LONGEST_INTERVAL = 0.025
# At rest [rad/s, motor]; moving enough to be worth a fit [rad/s, motor].
REST_SPEED, LEAST_MOTION = 3.0, 20.0
# Steady forward: motor speed [rad/s], acceleration [rad/s^2], shortest stretch [s].
STEADY_SPEED, STEADY_RATE, STEADY_TIME = 30.0, 10.0, 0.5
# The torque there is negative by some N m, the current positive by some A; what is not [N m, A].
WRONG_SIGN = 0.5
# Current that no bench of this kind needs at steady speed [A].
LARGEST_CURRENT = 200.0
# Flux of a motor of this kind [V s/rad]: most of its voltage is that times its speed.
VOLTS_PER_SPEED = (0.2, 5.0)
# Ratio of motor to drum speed over the gear ratio that scales, slip and noise cannot explain.
RATIO_WITHIN = 0.2

NAMES = {column.signal: name for name, column in LOG_COLUMNS.items()}


@dataclass(frozen=True)
class Preflight:
    """use : samples that count, by channel, shape (n,); notes : what the user should know."""

    use: Mapping[str, Use]
    notes: tuple[str, ...]


def preflight(measured: Log, gear_ratio: float) -> Preflight:
    """Check a log; raises LogError for what cannot be used."""
    interval = _interval(measured)
    notes = _holes(measured, interval)
    _starts_at_rest(measured)
    _moves(measured)
    _one_gear(measured, gear_ratio)
    _signs(measured, interval)
    wrong = _wrong_voltage(measured)
    if wrong:
        notes.append(f"{measured.source}: {NAMES[VOLTAGE]} {wrong}; it is left out")
        measured = without_voltage(measured)
    use = {}
    for name in compared_channels(measured):
        try:
            use[name], more = _counting_samples(measured, name)
        except LogError as error:
            if name != VOLTAGE:
                raise
            more = [f"{error}; it is left out"]
        notes += more
    if "armature_current" not in measured and VOLTAGE not in use:
        notes.append(
            f"{measured.source}: without {NAMES['armature_current']} the flux (K_1, K_2) shows in "
            "the speeds only where the voltage is at its limit"
        )
    return Preflight(use, tuple(notes))


def _interval(measured: Log) -> float:
    interval = float(np.median(np.diff(measured.time)))
    if interval > LONGEST_INTERVAL:
        raise LogError(
            f"{measured.source}: a sample every {interval:g} s; the spikes of the backlash need "
            f"one every {LONGEST_INTERVAL:g} s or faster"
        )
    return interval


def _holes(measured: Log, interval: float) -> list[str]:
    """Notes on holes; LogError for a long one."""
    gaps = np.diff(measured.time)
    worst = int(np.argmax(gaps))
    if gaps[worst] > LONGEST_HOLE:
        raise LogError(
            f"{measured.source}: no samples from {measured.time[worst]:.3f} s to "
            f"{measured.time[worst + 1]:.3f} s; cut the log there, or export it without a hole"
        )
    holes = np.flatnonzero(gaps > 1.5 * interval)
    if len(holes) == 0:
        return []
    first = measured.time[holes[0]]
    note = f"{measured.source}: {len(holes)} holes, the first at {first:.3f} s; "
    return [note + "the inputs are continued across them, and no sample counts there"]


def _starts_at_rest(measured: Log) -> None:
    first = float(np.median(measured["motor_speed"][:5]))
    if abs(first) > REST_SPEED:
        raise LogError(
            f"{measured.source}: {NAMES['motor_speed']} starts at {first:.1f}; a run must start "
            "at rest, because current, integrators and shaft twist are taken as zero there"
        )


def _moves(measured: Log) -> None:
    span = float(np.ptp(measured["motor_speed"]))
    if span < LEAST_MOTION:
        raise LogError(
            f"{measured.source}: {NAMES['motor_speed']} moves by {span:.1f} rad/s only; a run "
            f"over {LEAST_MOTION:g} rad/s or more is needed"
        )


def _one_gear(measured: Log, gear_ratio: float) -> None:
    motor, drum = measured["motor_speed"], measured["drum_speed"]
    fast = np.abs(motor) > 0.5 * np.max(np.abs(motor))
    ratio = float(np.median(drum[fast] / motor[fast])) * gear_ratio
    if abs(ratio - 1.0) > RATIO_WITHIN:
        raise LogError(
            f"{measured.source}: {NAMES['drum_speed']} is {ratio:.3g} times "
            f"{NAMES['motor_speed']} / {gear_ratio:g}; check the units and signs of both"
        )


def _signs(measured: Log, interval: float) -> None:
    """The commissioning check: without a truck the motor drives at steady forward speed."""
    if has_truck(measured):
        return
    half = max(1, round(0.5 * STEADY_TIME / interval))
    speed = measured["motor_speed"]
    rate = np.full(len(speed), np.inf)
    rate[half:-half] = np.abs(speed[2 * half :] - speed[: -2 * half]) / (2 * half * interval)
    steady = (rate < STEADY_RATE) & (speed > STEADY_SPEED)
    if not steady.any():
        return
    torque = float(np.median(measured["shaft_torque"][steady]))
    if torque > WRONG_SIGN:
        raise LogError(
            f"{measured.source}: {NAMES['shaft_torque']} is {torque:+.1f} while the motor drives "
            "at steady forward speed; it must be negative there: change its sign"
        )
    if "armature_current" not in measured:
        return
    current = float(np.median(measured["armature_current"][steady]))
    if not -WRONG_SIGN < current < LARGEST_CURRENT:
        raise LogError(
            f"{measured.source}: {NAMES['armature_current']} is {current:+.4g} while the motor "
            f"drives at steady forward speed; 0 to {LARGEST_CURRENT:g} is possible there: check "
            "its sign and unit"
        )


def _wrong_voltage(measured: Log) -> str:
    """The fault of a logged voltage, which no log needs; empty: the voltage can be used."""
    if VOLTAGE not in measured:
        return ""
    if VOLTAGE not in compared_channels(measured):
        return "does not move"
    speed, (low, high) = measured["motor_speed"], VOLTS_PER_SPEED
    for words, turning in (("forward", speed > STEADY_SPEED), ("reverse", speed < -STEADY_SPEED)):
        if not turning.any():
            continue
        ratio = float(np.median(measured[VOLTAGE][turning] / speed[turning]))
        if not low < ratio < high:
            return (
                f"is {ratio:+.3g} V for each rad/s at {words} speed, where {low:g} to {high:g} is "
                "possible (check its sign and unit, and that its sensor is connected)"
            )
    return ""


def _counting_samples(measured: Log, name: str) -> tuple[Use, list[str]]:
    """Samples of a channel that carry information, and notes on the samples that are left out."""
    channel = measured[name]
    nothing = np.zeros(len(channel), bool)
    repeated = _find_repeated(channel)
    others = (
        np.sum([_find_repeated(measured[o]) for o in compared_channels(measured)], axis=0)
        - repeated
    )
    alive = ~_runs(repeated, others, CERTAINLY_FROZEN)
    noisy = noise(channel, alive) > NOISY * np.ptp(channel)
    held = repeated if _is_held(channel, repeated) else nothing
    frozen = _find_frozen(repeated, others, float(np.mean(repeated[alive]))) if noisy else nothing
    clipped = _find_clipped(channel, repeated, others) if noisy else nothing
    causes = {
        "is slower than the log and held between its samples": held,
        "is at the end of its range": clipped,
        "stands still": frozen & ~clipped & ~held,
    }
    place = f"{measured.source}: {NAMES[name]}"
    notes = []
    for what, part in causes.items():
        share = 100.0 * float(np.mean(part))
        if share > 100.0 * USELESS_SHARE and part is not held:
            raise LogError(f"{place} {what} for {share:.0f} % of the run; it cannot be used")
        if part.any():
            first = measured.time[int(np.argmax(part))]
            notes.append(f"{place} {what}, first at {first:.3f} s; {share:.1f} % is left out")
    return ~(held | frozen | clipped), notes


def _find_repeated(channel: Array) -> Use:
    return np.concatenate([[False], np.diff(channel) == 0.0])


def _is_held(channel: Array, repeated: Use) -> bool:
    """Whether samples repeat the one before while the channel moves, at the beat of a task.

    A channel with a coarse quantum repeats values as well, but at no beat.
    """
    reach = 5
    moving = np.zeros(len(channel), bool)
    span = np.abs(channel[2 * reach :] - channel[: -2 * reach])
    moving[reach:-reach] = span > 0.02 * np.ptp(channel)
    if moving.sum() <= 20 or np.mean(repeated[moving]) <= HELD_SHARE:
        return False
    fresh = ~repeated
    after_fresh = fresh[1:][moving[1:] & fresh[:-1]]
    if len(after_fresh) == 0:
        return True
    return bool(np.mean(after_fresh) < HELD_SPACING * np.mean(fresh[moving]))


def _find_frozen(repeated: Use, others: Array, share: float) -> Use:
    """Samples in runs of equal ones that are too long for chance.

    others : how many other channels repeat each sample; share : of repeated samples by chance
    """
    if not 0.0 < share < HELD_SHARE:
        return np.zeros(len(repeated), bool)
    return _runs(
        repeated, others, max(SHORTEST_FROZEN, ceil(log(CHANCE / len(repeated)) / log(share)))
    )


def _find_clipped(channel: Array, repeated: Use, others: Array) -> Use:
    """Samples in runs of the channel's largest or smallest value, which noise would not repeat."""
    found = np.zeros(len(channel), bool)
    for end in (np.max(channel), np.min(channel)):
        at_end = channel == end
        part = _runs(at_end & repeated, others, SHORTEST_CLIPPED - 1)
        found |= at_end & (part | np.roll(part, -1))
    return found


def _runs(marked: Use, others: Array, shortest: int) -> Use:
    """Marked samples in runs of at least `shortest` during which some other channel changes."""
    edges = np.diff(np.concatenate([[0], marked.astype(int), [0]]))
    found = np.zeros(len(marked), bool)
    for begin, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        alone = np.mean(others[begin:end] < np.max(others)) > 0.5
        if end - begin >= shortest and alone:
            found[begin:end] = True
    return found
