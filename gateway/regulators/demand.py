"""Output of a regulator."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Demand:
    """Demanded motor speed [rad/s], and its slope until the next sample [rad/s^2]."""

    speed: float
    rate: float = 0.0
