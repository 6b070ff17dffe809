"""The steady speeds of a sweep in a document, as a program (pure).

The measurement of losses puts a `sweep` into its configuration: speeds that are held in turn.
"""

from collections.abc import Mapping
from typing import Any, Final

from gateway.configuration.program import Program, Ramp
from gateway.errors import ConfigError
from register_maps.units import RPM

RANGES: Final = {"hold_s": (3.0, 3600.0), "rate_rpm_s": (10.0, 3000.0)}
SLOWEST_RPM, FASTEST_RPM = 60.0, 4830.0
DEFAULT: Final = (200.0, 400.0, 800.0, 1400.0, 2100.0, 2900.0, 3700.0, 4500.0)
"""[rpm] Dense where the friction curve bends; the drum's rim moves at 0.8 .. 17.5 km/h."""
HOLD_S: Final = 8.0
RATE_RPM_S: Final = 300.0


def read_sweep(table: object, place: str) -> Program:
    """Program of a table with speeds_rpm, hold_s, rate_rpm_s. Raises ConfigError."""
    if not isinstance(table, Mapping) or set(table) != {"speeds_rpm", *RANGES}:
        wanted = ", ".join(("speeds_rpm", *RANGES))
        raise ConfigError("no sweep", place=place, value=table, expected=f"a table with {wanted}")
    speeds = table["speeds_rpm"]
    if not isinstance(speeds, list) or not speeds:
        where = f"{place}.speeds_rpm"
        raise ConfigError("no speeds", place=where, value=speeds, expected="a list of rpm")
    found = [_number(f"{place}.speeds_rpm", one, SLOWEST_RPM, FASTEST_RPM) for one in speeds]
    hold = _number(f"{place}.hold_s", table["hold_s"], *RANGES["hold_s"])
    rate = RPM * _number(f"{place}.rate_rpm_s", table["rate_rpm_s"], *RANGES["rate_rpm_s"])
    steps = [Ramp(speed=RPM * speed, rate=rate, hold=hold) for speed in found]
    return Program(name="sweep", steps=(*steps, Ramp(speed=0.0, rate=rate, hold=0.0)))


def _number(place: str, value: Any, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise ConfigError("bad value", place=place, value=value, expected=f"{low:g} .. {high:g}")
    return float(value)
