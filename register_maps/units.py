"""The units that a register map may use, and how each becomes SI.

One small table. A value as the operator reads it is `scaled`; SI value = scaled * factor + shift.
Nothing else in this house knows of rpm or degC except the borders that show them.
"""

import math
from dataclasses import dataclass
from typing import Final

RPM: Final = 2.0 * math.pi / 60.0
"""One revolution per minute [rad/s]."""
ZERO_CELSIUS: Final = 273.15
"""Zero degrees Celsius [K]."""


@dataclass(frozen=True, kw_only=True)
class Unit:
    """How a scaled value becomes SI: `si` is the SI unit that comes out."""

    si: str
    factor: float = 1.0
    shift: float = 0.0

    def to_si(self, scaled: float) -> float:
        """Value in the SI unit."""
        return scaled * self.factor + self.shift

    def from_si(self, value: float) -> float:
        """Value in this unit, as the operator reads it."""
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
