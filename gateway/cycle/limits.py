"""The last word on every setpoint. Knows no regulator and no state: whoever asks gets the same.

A setpoint is finite, inside the bench's range, no faster than its slopes allow, and rises neither
more than `deviation` over the measured speed nor on stale data. The PLC goes on along the slope
that came with a setpoint when no further one comes; where that ends has to hold as well. Downward
is the safe direction: measurements never keep a setpoint from falling. What is not a number counts
as standstill.
"""

from dataclasses import dataclass
from enum import Flag, auto
from math import isfinite

from register_maps.timing import HOLD


class Limit(Flag):
    """What kept the setpoint from what was wanted."""

    NONE = 0
    NOT_FINITE = auto()
    DEVIATION = auto()
    STALE = auto()
    RATE = auto()
    RANGE = auto()


@dataclass(frozen=True, kw_only=True)
class Limits:
    """speed_max [rad/s], rate_up, rate_down [rad/s^2], deviation [rad/s], stale [s]"""

    speed_max: float
    rate_up: float
    rate_down: float
    deviation: float
    stale: float


@dataclass(frozen=True, kw_only=True)
class Limited:
    """Setpoint [rad/s], its slope until the next one [rad/s^2], and what has limited it."""

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
    """What is allowed of a wanted motor speed and its slope.

    last : setpoint before [rad/s], dt ago [s]; measured : motor [rad/s]; age : of that sample [s]
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
    """Highest setpoint that the measured speed allows; a motor not measured may not speed up."""
    return measured + limits.deviation if isfinite(measured) else last


def _limit_ceiling(speed: float, ceiling: float, name: Limit, by: Limit) -> tuple[float, Limit]:
    return _note(speed, min(speed, ceiling), name, by)


def _interval(dt: float, limits: Limits) -> float:
    """Time that counts for the slope [s]: a gap earns no jump, a time that is no time nothing."""
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
    """Steepest rise with which the PLC, left alone, still ends under all ceilings [rad/s^2]."""
    return min(limits.rate_up, (min(ceiling, limits.speed_max) - speed) / HOLD)
