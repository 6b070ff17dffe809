"""The units that a register map may use, and their conversion to SI.

A value in such a unit is a scaled value; SI value = scaled value * factor + shift. Other units than
SI appear only where a value is read from or shown to the operator.
"""

import math
from dataclasses import dataclass
from typing import Final

RPM: Final = 2.0 * math.pi / 60.0
"""One revolution per minute [rad/s]."""
KMH: Final = 1.0 / 3.6
"""One kilometre per hour [m/s]."""
ZERO_CELSIUS: Final = 273.15
"""Zero degrees Celsius [K]."""


@dataclass(frozen=True, kw_only=True)
class Unit:
    """Conversion of a unit to its SI unit `si`."""

    si: str
    factor: float = 1.0
    shift: float = 0.0

    def to_si(self, scaled: float) -> float:
        """Value in the SI unit of a scaled value."""
        return scaled * self.factor + self.shift

    def from_si(self, value: float) -> float:
        """Scaled value in this unit of an SI value."""
        return (value - self.shift) / self.factor


UNITS = {
    "1": Unit(si="1"),
    "count": Unit(si="1"),
    "s": Unit(si="s"),
    "ms": Unit(si="s", factor=1e-3),
    "us": Unit(si="s", factor=1e-6),
    "m": Unit(si="m"),
    "m/s": Unit(si="m/s"),
    "rad": Unit(si="rad"),
    "rad/s": Unit(si="rad/s"),
    "rpm": Unit(si="rad/s", factor=RPM),
    "rad/s^2": Unit(si="rad/s^2"),
    "rpm/s": Unit(si="rad/s^2", factor=RPM),
    "N": Unit(si="N"),
    "N m": Unit(si="N m"),
    "N m s": Unit(si="N m s"),
    "A": Unit(si="A"),
    "mA": Unit(si="A", factor=1e-3),
    "V": Unit(si="V"),
    "K": Unit(si="K"),
    "degC": Unit(si="K", shift=ZERO_CELSIUS),
}
