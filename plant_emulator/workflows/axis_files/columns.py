"""Which column of a file holds which quantity of an axis, and in which unit.

A choice is `NAME=COLUMN[*FACTOR][:UNIT]`, as in `position=enc:deg` or `force=iq*0.40*28:Nm`.
Several factors are multiplied, `/` divides; the unit is that of the product. Without a unit the
file's own counts: a unit beside the column's name, or the one that an accepted name ends in.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

from plant_emulator.errors import LogError
from plant_emulator.workflows.axis_files.units import target

if TYPE_CHECKING:
    from collections.abc import Sequence

# Columns that need no choice: the quantity and the unit of each, by name.
ACCEPTED: Mapping[str, tuple[str, str]] = {
    "time_s": ("time", "s"),
    "position_m": ("position", "m"),
    "position_rad": ("position", "rad"),
    "velocity_m_s": ("velocity", "m/s"),
    "velocity_rad_s": ("velocity", "rad/s"),
    "force_N": ("force", "N"),
    "torque_Nm": ("force", "N m"),
    "load_force_N": ("load", "N"),
    "load_torque_Nm": ("load", "N m"),
    "temperature_degC": ("temperature", "degC"),
}
# The same without a unit, for files that keep the unit apart.
BARE = {
    "time": "time",
    "position": "position",
    "velocity": "velocity",
    "force": "force",
    "torque": "force",
    "load_force": "load",
    "load_torque": "load",
    "temperature": "temperature",
}
NAMES = ("time", "position", "velocity", "force", "torque", "load", "temperature")
FORM = re.compile(
    r"(?P<column>.+?)(?P<factors>(\s*[*/]\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)*)\s*(:(?P<unit>[^:,]*))?"
)
FACTOR = re.compile(r"([*/])\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)")
IN_BRACKETS = re.compile(r"\s*[\[(](?P<unit>[^\])]*)[\])]\s*$")


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A column of a file for a quantity; unit : of column times factor, None: as the file says."""

    quantity: str
    column: str
    factor: float = 1.0
    unit: str | None = None

    @property
    def text(self) -> str:
        """The choice without its unit, as a user would write it."""
        times = f"*{self.factor:g}" if self.factor != 1.0 else ""
        return f"{self.quantity}={self.column}{times}"


def choices(columns: Sequence[str] | Mapping[str, str]) -> tuple[Choice, ...]:
    """The choices in these words, or by name; raises LogError for words that are none."""
    words = [f"{k}={v}" for k, v in columns.items()] if isinstance(columns, Mapping) else columns
    found = tuple(map(_choice, words))
    names = [one.quantity for one in found]
    if doubled := [name for name in names if names.count(name) > 1]:
        raise LogError(f"{doubled[0]} is chosen twice; one column is needed", argument="columns")
    return found


def _choice(word: str) -> Choice:
    name, _, rest = word.partition("=")
    form = FORM.fullmatch(rest.strip())
    if name.strip() not in NAMES or form is None:
        raise LogError(
            f"{word!r}; NAME=COLUMN[*FACTOR][:UNIT] is expected, NAME one of {', '.join(NAMES)}",
            argument="columns",
        )
    factor = 1.0
    for sign, number in FACTOR.findall(form["factors"]):
        if (value := float(number)) == 0.0 or not isfinite(value):
            raise LogError(f"{word!r}: factor {number}; another one is needed", argument="columns")
        factor = factor * value if sign == "*" else factor / value
    quantity = name.strip().replace("torque", "force")
    return Choice(
        quantity=quantity, column=form["column"].strip(), factor=factor, unit=form["unit"] or None
    )


def unit_in(column: str) -> str | None:
    """Unit that the name of a column contains: of an accepted name, or in brackets."""
    if column in ACCEPTED:
        return ACCEPTED[column][1]
    found = IN_BRACKETS.search(column)
    return found["unit"].strip() if found else None


def quantity_of(column: str) -> str | None:
    """Quantity of a column that needs no choice, by its name; None: another column."""
    if column in ACCEPTED:
        return ACCEPTED[column][0]
    return BARE.get(IN_BRACKETS.sub("", column).strip().lower())


def unit_behind(column: str) -> tuple[str, str] | None:
    """Quantity and unit of a name such as `position_deg` or `velocity_mm_s`; None: no such name."""
    for name, quantity in sorted(BARE.items(), key=lambda item: -len(item[0])):
        unit = column.removeprefix(f"{name}_").replace("_", "/")
        if column.startswith(f"{name}_") and column not in ACCEPTED and target(quantity, unit):
            return quantity, unit
    return None
