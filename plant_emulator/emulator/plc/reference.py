"""The speed reference that the PLC gives the drive within one scan.

Between two commands the reference follows the slope of the last command, but only for `HOLD`.
Otherwise a dead gateway could accelerate the drum until the watchdog expires. The reference is
clamped to the bench's speed range, and its slope to the slew limit.
"""

from dataclasses import dataclass

from register_maps.timing import HOLD
from register_maps.units import RPM

# Thesis: 4830 rpm is 105 % of the rated 4600 rpm; the bench does not run backwards.
SPEED_MAX = 4830 * RPM


@dataclass(frozen=True, kw_only=True)
class Target:
    """Target of the reference: speed + slope x age [rad/s], approached no faster than slew.

    slope, slew [rad/s^2]; age of the command [s]
    """

    speed: float
    slope: float
    slew: float
    age: float

    def at(self, ahead: float) -> float:
        """Target speed in `ahead` seconds, clamped to the bench's range [rad/s]."""
        asked = self.speed + self.slope * min(self.age + ahead, HOLD)
        return min(max(asked, 0.0), SPEED_MAX)


STOP_AT_ONCE = Target(speed=0.0, slope=0.0, slew=float("inf"), age=0.0)


def ramp_down(slew: float) -> Target:
    """Target of an orderly stop; slew : largest slope [rad/s^2]."""
    return Target(speed=0.0, slope=0.0, slew=slew, age=0.0)


def trajectory(reference: float, target: Target, step: float, count: int) -> list[float]:
    """References at the ends of the next `count` sub-steps of `step` seconds [rad/s]."""
    most = target.slew * step
    path = []
    for number in range(1, count + 1):
        change = target.at(number * step) - reference
        reference += min(max(change, -most), most)
        path.append(reference)
    return path


def is_limited(path: list[float], target: Target, step: float) -> bool:
    """Whether a limit keeps the end of a path [rad/s] away from the command's target; step [s]."""
    wanted = target.speed + target.slope * min(target.age + len(path) * step, HOLD)
    return abs(path[-1] - wanted) > 1e-9 * SPEED_MAX
