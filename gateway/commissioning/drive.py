"""A drive program for the live bench, and its refusal where the limits would clip it (pure).

The limits pass every setpoint of a program that is not refused here. Otherwise the recording would
show another program than the one that was asked for.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from gateway.configuration.config import Config
from gateway.configuration.program import Profile, Program, Ramp, Step
from gateway.configuration.sweep_speeds import RATE_RPM_S
from gateway.errors import ConfigError
from gateway.review.limits import delay_of
from register_maps.logs.drive_programs import interpolate
from register_maps.units import RPM

ROUNDING_SLACK: Final = 1.0 + 1e-9
"""Room for rounding in the conversion of units."""


@dataclass(frozen=True, kw_only=True)
class Point:
    """Corner of a program: time [s], motor speed [rad/s], and how long the speed is held [s]."""

    time: float
    speed: float
    dwell: float = 0.0


def program_of(name: str, points: Sequence[Point], repeats: int = 1) -> Program:
    """Program through these points, several times over; it ends at standstill.

    name : of the program or of its file. Raises ConfigError for points that give no program.
    """
    _refuse_points(name, points, repeats)
    corners: list[tuple[float, float]] = []
    for _ in range(repeats):
        since = corners[-1][0] if corners else 0.0
        passed = list(_corners(points, since))
        corners += passed[1:] if corners else passed
    times, speeds = zip(*corners, strict=True)
    steps: list[Step] = [Profile(times=times, speeds=speeds)]
    if speeds[-1] > 0.0:
        steps.append(Ramp(speed=0.0, rate=RATE_RPM_S * RPM, hold=0.0))
    return Program(name=name, steps=tuple(steps))


def _corners(points: Iterable[Point], since: float) -> Iterable[tuple[float, float]]:
    """Corners of one pass that begins at `since` [s]; every dwell delays what follows."""
    for point in points:
        yield since + point.time, point.speed
        if point.dwell > 0.0:
            since += point.dwell
            yield since + point.time, point.speed


def _refuse_points(name: str, points: Sequence[Point], repeats: int) -> None:
    if len(points) < 2 or points[0].time != 0.0:
        raise ConfigError(
            "no program",
            file=name,
            value=f"{len(points)} points" + (f" from {points[0].time:g} s" if points else ""),
            expected="two points or more, from 0 s",
        )
    for number, (one, after) in enumerate(pairwise(points), 2):
        if after.time <= one.time:
            raise ConfigError(
                "the time does not increase",
                file=name,
                place=f"point {number}",
                value=f"{after.time:g} s",
                expected=f"more than {one.time:g} s",
            )
    first, last = points[0].speed, points[-1].speed
    if first != 0.0:
        raise ConfigError(
            "the bench stands at the start",
            file=name,
            place="first point",
            value=f"{first / RPM:.0f} rpm",
            expected="0",
        )
    if repeats > 1 and last != first:
        raise ConfigError(
            "a program that is repeated has to end at standstill",
            file=name,
            place="last point",
            value=f"{last / RPM:.0f} rpm",
            expected="0",
        )


def configure_program(config: Config, program: Program) -> Config:
    """Configuration that runs the program. Raises ConfigError where the limits would clip it."""
    for step in program.steps:
        if isinstance(step, Profile):
            _refuse_clipped(config, program.name, step)
    return config.with_program(program)


def _refuse_clipped(config: Config, name: str, step: Profile) -> None:
    most, delay = config.limits, delay_of(config)
    for time, speed in zip(step.times, step.speeds, strict=True):
        if not 0.0 <= speed <= most.speed_max * ROUNDING_SLACK:
            raise _refusal(name, time, "speed", speed, "rpm", "speed_max_rpm", most.speed_max)
    for (since, before), (time, speed) in pairwise(zip(step.times, step.speeds, strict=True)):
        slope = (speed - before) / (time - since)
        if slope > most.rate_up * ROUNDING_SLACK:
            raise _refusal(name, since, "slope", slope, "rpm/s", "rate_up_rpm_s", most.rate_up)
        if -slope > most.rate_down * ROUNDING_SLACK:
            raise _refusal(name, since, "slope", slope, "rpm/s", "rate_down_rpm_s", most.rate_down)
    for time in step.times:
        for moment in (time, time + delay):
            before = interpolate(step.times, step.speeds, moment - delay)
            lag = interpolate(step.times, step.speeds, moment) - before
            if lag > most.deviation * ROUNDING_SLACK:
                raise _refusal(
                    name, moment, "lag of the bench", lag, "rpm", "deviation_rpm", most.deviation
                )


def _refusal(
    name: str, time: float, what: str, value: float, unit: str, key: str, limit: float
) -> ConfigError:
    return ConfigError(
        f"the limits would clip the {what}",
        file=name,
        place=f"{time:.2f} s",
        value=f"{value / RPM:.0f} {unit}",
        expected=f"0 .. limits.{key} = {limit / RPM:.0f}",
    )
