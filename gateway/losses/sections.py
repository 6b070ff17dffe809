"""Steady stretches of a run, and the friction of the bench in each of them (pure).

At steady speed without a truck, the motor gives exactly the torque of the friction. The sensor
between motor and gear then shows the parasitic loss of the bench, which 40 CFR 1066.255 makes
dynamometers verify:

    T_f = -xi mean(T_meas) - (J_g + J_d) mean(theta_d'')            (thesis, eq 4.9 with T_w' = 0)

The second term is small. It is also exact while the drum floats in the backlash, where the drum's
speed does not change. A stretch is steady where the mean speeds of the half second before and after
each of its moments differ by less than STEADY allows. An unusable stretch is left out with a
reason.

A constant error of the torque sensor ends up in the friction, because the bench only turns forward
(0..4830 rpm). A regulator that reads the same sensor is right nevertheless.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.arrays import Array
from gateway.configuration.sections import BenchConfig, RegulatorConfig
from gateway.errors import GatewayError
from register_maps.units import RPM

PLAIN: Final = RegulatorConfig()
"""A torque sensor without known errors."""
HALF: Final = 0.5
"""[s] Time before and after a moment over which its slope is taken."""
LONGEST_SECTION: Final = 2.4 * HALF
"""[s] Longest span of the samples of both halves; a longer span has a hole."""
STEADY: Final = 0.5
"""[rad/s^2] Slope of the motor speed; the drum's inertia takes 2.5 N m, under 1 % of the
friction."""
STANDSTILL_SPEED: Final = 5.0
"""[rad/s] Motor speed below which the bench stands."""
SHORTEST_SECTION, WORTH_NAMING = 1.0, 0.2
"""[s] Least duration of a stretch that is used, and of a stretch that is named as left out."""
COARSEST_SAMPLING: Final = 0.5 * HALF
"""[s] Longest time between two samples."""
SPEED_MISMATCH: Final = 0.1
"""Relative difference of drum and gear that shows a wrong ratio, scale or a frozen channel."""
DRIFT: Final = 0.02
"""Largest relative change of the speed over a stretch."""
BATCHES: Final = 5
UNSTEADY: Final = 0.15
"""Largest difference of the batches of a stretch relative to the mean torque: one load."""


class LossesError(GatewayError):
    """The run does not show the friction of the bench."""

    exit_code = 2


class SignError(LossesError):
    """The torque has the wrong sign where the motor must drive; a commissioning check."""


@dataclass(frozen=True, kw_only=True)
class SweepTrace:
    """Signals of a run in SI, shape (n,) each; shaft_torque : mean up to each sample, if known."""

    name: str
    time: Array
    motor_speed: Array
    drum_speed: Array
    shaft_torque: Array
    shell_temperature: Array | None = None


@dataclass(frozen=True, kw_only=True)
class Section:
    """A steady stretch of a run: times [s], and means in SI.

    friction, standard_error : at the gear output [N m]; the error follows from the torque's scatter
    shell_temperature : [K], None: unknown
    """

    run: str
    start: float
    end: float
    motor_speed: float
    gear_speed: float
    shaft_torque: float
    friction: float
    standard_error: float
    shell_temperature: float | None = None

    @property
    def duration(self) -> float:
        """Duration of the stretch [s]."""
        return self.end - self.start


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """A stretch of a run that is not used: times [s], motor speed [rad/s], and the reason."""

    run: str
    start: float
    end: float
    motor_speed: float
    why: str


@dataclass(frozen=True, kw_only=True)
class Steady:
    """Stretches of a run: those that are used, and those that are left out."""

    sections: tuple[Section, ...]
    left_out: tuple[LeftOut, ...]


def steady(trace: SweepTrace, bench: BenchConfig, sensor: RegulatorConfig = PLAIN) -> Steady:
    """Steady stretches of a run with the friction in each.

    sensor : knows the errors of the torque sensor

    Raises SignError where the torque is that of a truck that drives, or of a sensor with the wrong
    sign. Raises LossesError where the samples are too far apart.
    """
    every = float(np.median(np.diff(trace.time)))
    if every > COARSEST_SAMPLING:
        raise LossesError(
            f"a sample every {every:g} s; expected one every {COARSEST_SAMPLING:g} s or faster"
        )
    sections: list[Section] = []
    left_out: list[LeftOut] = []
    for part in _stretches(trace):
        why = _rejection(trace, part, bench.gear_ratio)
        if why:
            left_out.append(_leave_out(trace, part, why))
        else:
            sections.append(_section(trace, part, bench, sensor))
    _refuse_sign(sections)
    return Steady(sections=_pool_noise(sections), left_out=tuple(left_out))


def _stretches(trace: SweepTrace) -> Iterator[slice]:
    """Samples in which the motor turns at a constant speed, stretch by stretch."""
    still = np.abs(_slope(trace.time, trace.motor_speed)) < STEADY
    turning = still & (np.abs(trace.motor_speed) > STANDSTILL_SPEED)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], turning.astype(np.int8), [0]))))
    for first, last in zip(edges[::2], edges[1::2] - 1, strict=True):
        if trace.time[last] - trace.time[first] >= WORTH_NAMING:
            yield slice(int(first), int(last) + 1)


def _slope(time: Array, values: Array) -> Array:
    """Slope at each sample, from the means of the HALF second after and before it; inf: unknown.

    The slope is unknown at both ends and around a hole in the log.
    """
    count = max(1, round(HALF / float(np.median(np.diff(time)))))
    slope = np.full_like(values, np.inf)
    if len(values) <= 2 * count:
        return slope
    mean_time, mean_value = _moving_mean(time, count), _moving_mean(values, count)
    inside = slice(count, len(values) - count + 1)
    span = mean_time[count:] - mean_time[:-count]
    slope[inside] = (mean_value[count:] - mean_value[:-count]) / span
    over_a_gap = time[2 * count - 1 :] - time[: len(time) - 2 * count + 1] > LONGEST_SECTION
    slope[inside][over_a_gap] = np.inf
    return slope


def _moving_mean(values: Array, count: int) -> Array:
    total = np.concatenate(([0.0], np.cumsum(values - values[0])))
    mean: Array = values[0] + (total[count:] - total[:-count]) / count
    return mean


def _rejection(trace: SweepTrace, part: slice, gear_ratio: float) -> str:
    """Reason for which a stretch cannot be used; empty: it can."""
    time, speed, torque = trace.time[part], trace.motor_speed[part], trace.shaft_torque[part]
    if speed.mean() < 0.0:
        return "turns backwards; the bench is rated for 0..4830 rpm, forward only"
    if time[-1] - time[0] < SHORTEST_SECTION:
        return f"only {time[-1] - time[0]:.2f} s steady; expected {SHORTEST_SECTION:g} s"
    change = abs(float(np.polyfit(time - time[0], speed, 1)[0])) * (time[-1] - time[0])
    if change > DRIFT * speed.mean():
        return f"speed drifts by {100.0 * change / speed.mean():.1f} %; expected {DRIFT:.0%}"
    gear, drum = speed.mean() / gear_ratio, float(trace.drum_speed[part].mean())
    if abs(gear - drum) > SPEED_MISMATCH * gear:
        return f"gear {gear:.3f} rad/s and drum {drum:.3f} rad/s do not belong together"
    spread, mean = float(np.ptp(_batch_means(torque))), abs(float(torque.mean()))
    if spread > UNSTEADY * mean:
        return f"torque is not steady: its means differ by {spread:.1f} N m of {mean:.1f} N m"
    return ""


def _batch_means(values: Array) -> Array:
    return np.array([batch.mean() for batch in np.array_split(values, BATCHES)])


def _leave_out(trace: SweepTrace, part: slice, why: str) -> LeftOut:
    time = trace.time[part]
    speed = float(trace.motor_speed[part].mean())
    start, end = float(time[0]), float(time[-1])
    return LeftOut(run=trace.name, start=start, end=end, motor_speed=speed, why=why)


def _section(
    trace: SweepTrace, part: slice, bench: BenchConfig, sensor: RegulatorConfig
) -> Section:
    """Friction in one steady stretch, with the standard error of its batches."""
    xi, inertia = bench.gear_ratio, bench.gear_inertia + bench.drum_inertia
    time, torque = trace.time[part], sensor.shaft_torque(trace.shaft_torque[part])
    acceleration = float(np.polyfit(time - time[0], trace.drum_speed[part], 1)[0])
    motor_speed, mean = float(trace.motor_speed[part].mean()), float(torque.mean())
    scatter = float(_batch_means(torque).std(ddof=1)) / np.sqrt(BATCHES)
    shell = trace.shell_temperature
    return Section(
        run=trace.name,
        start=float(time[0]),
        end=float(time[-1]),
        motor_speed=motor_speed,
        gear_speed=motor_speed / xi,
        shaft_torque=mean,
        friction=-xi * mean - inertia * acceleration,
        standard_error=float(xi * scatter),
        shell_temperature=None if shell is None else float(shell[part].mean()),
    )


def _refuse_sign(sections: list[Section]) -> None:
    wrong = [one for one in sections if one.shaft_torque > 0.0]
    if not wrong:
        return
    worst = max(wrong, key=lambda one: one.shaft_torque)
    raise SignError(
        f"the sign of the shaft torque is wrong, or a truck drives the drum: at steady forward "
        f"speed the sensor shows {worst.shaft_torque:+.2f} N m ({worst.start:.1f} .. "
        f"{worst.end:.1f} s, {worst.motor_speed / RPM:.0f} rpm; {len(wrong)} of "
        f"{len(sections)} steady stretches); expected below zero, as the motor drives"
    )


def _pool_noise(sections: list[Section]) -> tuple[Section, ...]:
    """Sections with one common noise, because a stretch has too few batches for its own."""
    if not sections:
        return ()
    power = np.mean([one.standard_error**2 * one.duration for one in sections])
    return tuple(
        Section(**{**vars(one), "standard_error": float(np.sqrt(power / one.duration))})
        for one in sections
    )
