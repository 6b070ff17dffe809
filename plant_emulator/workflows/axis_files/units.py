"""Units of files in words, and values in the units of an axis log, by the library pint.

A unit of an angle contains the angle: `1/s` is none of a speed in rad/s, and 1/min is read as
revolutions a minute, as drives write it.
"""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.errors import LogError

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

# Units that logs contain and pint reads as something else or not at all.
OWN = ("Nm = newton * meter", "Ncm = newton * centimeter", "Nmm = newton * millimeter")
ROTATIONS = re.compile(r"^(U|r|rev|1)?/min$|^min\^?-1$|^(r|R)PM$")
REVOLUTION = re.compile(r"\brevs?\b")
# Of what a unit may be, for each quantity of a log: the units in its log.
QUANTITIES = {
    "time": ("s",),
    "position": ("m", "rad"),
    "velocity": ("m/s", "rad/s"),
    "force": ("N", "N m"),
    "load": ("N", "N m"),
    "temperature": ("degC",),
}


@cache
def _registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry(on_redefinition="ignore")
    for line in OWN:
        registry.define(line)
    return registry


def unit_of(text: str) -> Any:
    """The unit in words, None where nobody knows it."""
    words = ROTATIONS.sub("rpm", text.strip())
    try:
        return _registry().Unit(REVOLUTION.sub("turn", words)) if words else None
    except Exception:  # noqa: BLE001 - a word that is no unit makes pint fail in many ways
        return None


def target(quantity: str, text: str) -> str | None:
    """Unit in which a log keeps values of this quantity and unit; None: it is no such unit."""
    unit = unit_of(text)
    if unit is None:
        return None
    return next((own for own in QUANTITIES[quantity] if _base(unit) == _base(unit_of(own))), None)


def _base(unit: Any) -> Any:
    """The unit in SI base units, angles among them."""
    return _registry().get_base_units(unit)[1]


def convert_unit(values: Array, text: str, own: str) -> Array:
    """Values in the unit `text` as values in the unit `own` of a log, shape (n,).

    Raises LogError where a converted value is not finite.
    """
    found = _registry().Quantity(values, unit_of(text)).to(unit_of(own)).magnitude
    if not np.isfinite(found).all():
        raise LogError(f"{text}: values that cannot be converted to {own}")
    return np.asarray(found, dtype=np.float64)
