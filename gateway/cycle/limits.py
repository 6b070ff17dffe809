"""The limits that every setpoint passes last: after them it is only encoded and sent.

They know no regulator and no state. The PLC limits the setpoint again by itself.

A setpoint is finite, lies inside the range of the bench, and changes no faster than the slopes. It
rises neither on stale data nor to more than `deviation` over the measured speed. The PLC continues
along the slope of the last command for `HOLD`; the end of that slope obeys the same limits.
Downward is the safe direction, so that no measurement keeps a setpoint from falling. A demand that
is not a number counts as standstill.
"""

from dataclasses import dataclass
from enum import Flag, auto
from math import isfinite

from register_maps.timing import HOLD


class Limit(Flag):
    """Limits that kept the setpoint from the demand."""

    NONE = 0
    NOT_FINITE = auto()
    DEVIATION = auto()
    STALE = auto()
    RATE = auto()
    RANGE = auto()


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of a setpoint.

    speed_max, deviation [rad/s]; rate_up, rate_down [rad/s^2]; stale : age of a sample [s]
    """

    speed_max: float
    rate_up: float
    rate_down: float
    deviation: float
    stale: float


@dataclass(frozen=True, kw_only=True)
class Limited:
    """Setpoint [rad/s], its slope until the next setpoint [rad/s^2], and the limits that acted."""

    speed: float
    rate: float
    by: Limit


def limit(
    wanted: float,
    rate: float,
    *,
    last: float,
    measured: float,
    age: float,
    dt: float,
    limits: Limits,
) -> Limited:
    """Setpoint that is allowed for a wanted motor speed [rad/s] and its slope [rad/s^2].

    last, dt : the setpoint before [rad/s], and the time since then [s]
    measured, age : measured motor speed [rad/s], and the age of that sample [s]
    """
    stale = not age <= limits.stale
    speed, by = _replace_not_finite(wanted)
    ceiling = _ceiling(last, measured, limits)
    speed, by = _limit_ceiling(speed, ceiling, Limit.DEVIATION, by)
    if stale:
        speed, by = _limit_ceiling(speed, last, Limit.STALE, by)
    speed, by = _limit_slope(speed, by, last, _interval(dt, limits), limits)
    speed, by = _limit_range(speed, by, limits)
    if by or not isfinite(rate):
        return Limited(speed=speed, rate=0.0, by=by)
    steepest = 0.0 if stale else _steepest(speed, ceiling, limits)
    return Limited(speed=speed, rate=min(max(rate, -limits.rate_down), steepest), by=by)


def _replace_not_finite(wanted: float) -> tuple[float, Limit]:
    return (wanted, Limit.NONE) if isfinite(wanted) else (0.0, Limit.NOT_FINITE)


def _ceiling(last: float, measured: float, limits: Limits) -> float:
    """Highest setpoint that the measured speed allows. An unknown speed allows no rise."""
    return measured + limits.deviation if isfinite(measured) else last


def _limit_ceiling(speed: float, ceiling: float, name: Limit, by: Limit) -> tuple[float, Limit]:
    return _note(speed, min(speed, ceiling), name, by)


def _interval(dt: float, limits: Limits) -> float:
    """Time that counts for the slope [s]. A gap allows no jump, and a negative time or NaN is 0."""
    return min(max(0.0, dt), limits.stale)


def _limit_slope(
    speed: float, by: Limit, last: float, interval: float, limits: Limits
) -> tuple[float, Limit]:
    lowest = last - limits.rate_down * interval
    highest = last + limits.rate_up * interval
    return _note(speed, min(max(speed, lowest), highest), Limit.RATE, by)


def _limit_range(speed: float, by: Limit, limits: Limits) -> tuple[float, Limit]:
    return _note(speed, min(max(speed, 0.0), limits.speed_max), Limit.RANGE, by)


def _note(speed: float, allowed: float, name: Limit, by: Limit) -> tuple[float, Limit]:
    return allowed, by if allowed == speed else by | name


def _steepest(speed: float, ceiling: float, limits: Limits) -> float:
    """Steepest rise whose end after `HOLD` stays under all ceilings [rad/s^2]."""
    return min(limits.rate_up, (min(ceiling, limits.speed_max) - speed) / HOLD)
