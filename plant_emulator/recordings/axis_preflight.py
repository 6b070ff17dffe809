"""Checks of a log of an axis before anything is fitted: frozen and held channels, signs.

Each check compares the log with what every machine obeys. A drive has to feed the losses of its
axis: over a run, force times velocity is positive. The force accelerates the axis forwards: its
regression on the acceleration is positive. Only a log that breaks both has a wrong sign.

The regression needs no derivative of a measured signal. Position and force are averaged by a
smooth weight of compact support, and the derivatives act on the weight (modulating functions: M.
Shinbrot, Trans. ASME 79 (1957) 547).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.recordings.axis_magnitudes import magnitude_note

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from plant_emulator.signals.axis_log import AxisLog
    from plant_emulator.signals.log import Array

# Half widths of the weights, in samples; each is used while so many weights fit into the run.
HALF_WIDTHS, FEWEST_WEIGHTS = (8, 16, 32, 64, 128, 256, 512, 1024), 40
# Parts of a run, each left out once: they give the standard error of the regression.
PARTS = 20
# The sign counts from so many standard errors on, and from this share of the largest power on.
CERTAIN, DISSIPATED = 4.0, 0.05
# A channel is frozen from so many equal samples on, if it moved before at this share of its top
# speed, over so many samples. A brake leaves slower ones in between.
FROZEN_SAMPLES, FROZEN_SPEED, STOP = 20, 0.3, 4
# A channel is held if most of its values stay for about the same number of samples.
HELD_CHANGES, HELD_SHARE = 50, 0.7
# A step between samples that is so much longer than the usual one is a hole.
HOLE_INTERVALS = 5.0


def axis_notes(logs: Sequence[AxisLog]) -> list[str]:
    """Notes on the runs for the user, a sentence each; LogError for a run that is no use."""
    notes = [note for log in logs for note in axis_preflight(log)]
    if unused := dict.fromkeys(name for log in logs for name in log.other):
        notes.append(f"columns that are not used: {', '.join(unused)}")
    return [magnitude_note(logs), *notes]


def axis_preflight(log: AxisLog) -> list[str]:
    """Notes on a log for the user, a sentence each; LogError where it cannot be used."""
    motion = "position" if log.velocity is None else "velocity"
    force = "torque" if log.rotary else "force"
    measured = log.position if log.velocity is None else log.velocity
    for name, values in ((motion, measured), (force, log.force)):
        if np.ptp(values) == 0.0:
            raise LogError(
                f"{log.source}: the {name} is frozen: it is {values[0]:g} in all samples; "
                "a run that moves is needed"
            )
    if motion == "position":
        _check_frozen_part(log)
    notes = _sign_notes(log, force)
    for name, values in ((motion, measured), (force, log.force)):
        if period := held_period(log.time, values):
            notes.append(
                f"{log.source}: the {name} is new only every {1e3 * period:.3g} ms and held "
                "between; a log without repeated values says more"
            )
    if log.load is not None:
        notes += _load_notes(log)
    return notes


def _check_frozen_part(log: AxisLog) -> None:
    """Refuse a position that stops between two samples while the axis moves fast."""
    time, position = log.time, log.position
    changes = np.flatnonzero(np.diff(position) != 0.0)
    speed = np.abs(position[STOP:] - position[:-STOP]) / (time[STOP:] - time[:-STOP])
    top = float(np.quantile(speed, 0.99))
    ends = np.r_[changes[1:], len(position) - 1]
    for last, end in zip(changes.tolist(), ends.tolist(), strict=True):
        first = last + 1
        before = speed[max(0, first - STOP)]
        if end - last >= FROZEN_SAMPLES and before > FROZEN_SPEED * top:
            raise LogError(
                f"{log.source}: the position is frozen: exactly {position[first]:g} from "
                f"{time[first]:.6g} s to {time[end]:.6g} s, just after moving at "
                f"{before:.3g} {'rad/s' if log.rotary else 'm/s'}; take a part without it, "
                f"as in {log.source}@{time[0]:.6g}:{time[first]:.6g}"
            )


def held_period(time: Array, values: Array) -> float | None:
    """Time for which each value is held [s]; None: a channel that is new at each sample.

    time : [s], values : of a channel, shape (n,) each
    """
    changes = np.flatnonzero(np.diff(values) != 0.0)
    if len(changes) < HELD_CHANGES:
        return None
    stays = np.diff(changes)
    usual = float(np.median(stays))
    alike = np.abs(stays - usual) <= max(1.0, 0.1 * usual)
    if usual < 3.0 or np.mean(alike) < HELD_SHARE:
        return None
    return usual * float(np.median(np.diff(time)))


def _sign_notes(log: AxisLog, force: str) -> list[str]:
    """Refuse a force that points against motion and acceleration; a note on one against motion."""
    found = [_regression(x, y) for x, y in _average(log)]
    if not found:
        return []
    inertia, power = max(found, key=lambda one: abs(one[0]))
    unit = "Nm" if log.rotary else "N"
    turn = f"turn it, as in --column force=COLUMN*-1:{unit}"
    if power > -DISSIPATED:
        return []
    if inertia < -CERTAIN:
        raise LogError(
            f"{log.source}: wrong sign: the {force} points against the acceleration (by "
            f"{-inertia:.0f} standard errors) and takes energy out of the axis; {turn}"
        )
    told = (
        f"{log.source}: the {force} takes energy out of the axis: wrong sign ({turn}), or "
        f"something else drives the axis (log it: --column load=COLUMN:{unit})"
    )
    if inertia < CERTAIN:
        raise LogError(told)
    return [told]


def _regression(regressors: Array, force: Array) -> tuple[float, float]:
    """Inertia over its standard error, and power over the largest that force and speed allow."""
    scaled = regressors / np.abs(regressors).max(axis=0)
    parts = np.array_split(np.arange(len(force)), PARTS)
    inertia = np.linalg.lstsq(scaled, force, rcond=1e-8)[0][0]
    without = [
        np.linalg.lstsq(np.delete(scaled, part, axis=0), np.delete(force, part), rcond=1e-8)[0][0]
        for part in parts
    ]
    error = np.sqrt((PARTS - 1) / PARTS * np.sum((np.array(without) - np.mean(without)) ** 2))
    speed = regressors[:, 1]
    largest = np.linalg.norm(force) * np.linalg.norm(speed)
    return float(inertia / error), float(force @ speed / largest)


def _average(log: AxisLog) -> Iterator[tuple[Array, Array]]:
    """Regressors and net force, averaged by weights of each width; rows of acceleration first."""
    step = float(np.median(np.diff(log.time)))
    net = log.force if log.load is None else log.force - log.load
    time = np.arange(log.time[0], log.time[-1], step)
    position = np.interp(time, log.time, log.position - log.position.mean())
    known = np.diff(log.time) < HOLE_INTERVALS * step
    known = known[np.searchsorted(log.time, time, side="right") - 1]
    values = np.interp(time, log.time, net)
    angles = (np.sin(position), np.cos(position)) if log.rotary else (position,)
    for width in HALF_WIDTHS:
        if len(time) < FEWEST_WEIGHTS * width // 2 + 2 * width:
            return
        s = np.arange(1 - width, width) / width
        weight = (1.0 - s**2) ** 4
        slope = -8.0 * s * (1.0 - s**2) ** 3 / (width * step)
        curve = (48.0 * s**2 - 8.0 * (1.0 - s**2)) * (1.0 - s**2) ** 2 / (width * step) ** 2

        weight, slope, curve = (by / weight.sum() for by in (weight, slope, curve))
        velocity = _means(position, -slope)
        direction = np.tanh(velocity / (0.02 * np.abs(velocity).max()))
        columns = [_means(position, curve), velocity, direction, np.ones_like(velocity)]
        columns += [_means(angle, weight) for angle in angles]
        whole = _means(known.astype(np.float64), weight) > 1.0 - 1e-9
        if whole.sum() > FEWEST_WEIGHTS:
            yield np.stack(columns, axis=1)[whole], _means(values, weight)[whole]


def _means(signal: Array, weight: Array) -> Array:
    """Sums of a signal by a weight that moves on by a quarter of its length."""
    spans = np.lib.stride_tricks.sliding_window_view(signal, len(weight))
    return np.asarray(spans[:: (len(weight) + 1) // 4] @ weight)


def _load_notes(log: AxisLog) -> list[str]:
    """Notes on the load channel for the user."""
    load = np.asarray(log.load)
    if np.ptp(load) == 0.0:
        return [f"{log.source}: the load is {load[0]:g} in all samples: it says nothing"]
    if 2.0 * np.var(log.force + load) < np.var(log.force - load):
        told = "the load seems to have the wrong sign: it counts as acting against the drive"
        return [f"{log.source}: {told}; turn it, as in --column load=COLUMN*-1:UNIT"]
    return []
