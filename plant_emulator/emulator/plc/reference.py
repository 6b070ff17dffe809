"""The speed reference that the PLC gives the drive within one scan.

Between two commands the PLC goes on along the slope that came with the last one, but only for
`HOLD`: a gateway that died must not drag the drum away before its watchdog bites. What is asked is
clamped to the bench's speed range and followed no faster than the slew limit.
"""

from dataclasses import dataclass
from math import pi

RPM = 2 * pi / 60
# Thesis: 4830 rpm is 105 % of the rated 4600 rpm; the bench does not run backwards.
SPEED_MAX = 4830 * RPM
# Ten polls at 100 Hz, one at the slowest period that makes sense.
HOLD = 0.1


@dataclass(frozen=True, kw_only=True)
class Target:
    """What the reference goes to: speed + slope x age [rad/s], no faster than slew [rad/s^2]."""

    speed: float
    slope: float
    slew: float
    age: float

    def at(self, ahead: float) -> float:
        """Speed asked for `ahead` seconds from now, inside the bench's range [rad/s]."""
        asked = self.speed + self.slope * min(self.age + ahead, HOLD)
        return min(max(asked, 0.0), SPEED_MAX)


STOP_AT_ONCE = Target(speed=0.0, slope=0.0, slew=float("inf"), age=0.0)


def ramp_down(slew: float) -> Target:
    """Target of an orderly stop."""
    return Target(speed=0.0, slope=0.0, slew=slew, age=0.0)


def trajectory(reference: float, target: Target, step: float, count: int) -> list[float]:
    """References [rad/s] at the ends of the next `count` sub-steps of `step` seconds each."""
    most = target.slew * step
    path = []
    for number in range(1, count + 1):
        change = target.at(number * step) - reference
        reference += min(max(change, -most), most)
        path.append(reference)
    return path


def limited(path: list[float], target: Target, step: float) -> bool:
    """Whether a limit keeps the end of the path from where the command wants it."""
    wanted = target.speed + target.slope * min(target.age + len(path) * step, HOLD)
    return abs(path[-1] - wanted) > 1e-9 * SPEED_MAX
