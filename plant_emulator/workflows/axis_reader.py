"""Reads a run of a single motor-driven axis: text, MATLAB, Parquet or MDF4.

Columns with accepted names (`axis_files/columns.py`) need no choice. Any other column is chosen,
as in `position=enc:deg` or `force=iq*0.40:Nm`. A log needs a time, a position or a velocity, and a
force or torque; it may hold an external load and a temperature.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.recordings.axis_magnitudes import check_magnitudes
from plant_emulator.signals.axis_log import AxisLog
from plant_emulator.workflows.axis_files import channels, matlab, text, units
from plant_emulator.workflows.axis_files.columns import (
    ACCEPTED,
    Choice,
    choices,
    quantity_of,
    unit_behind,
    unit_in,
)
from register_maps.logs import mdf4_log, parquet_log

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.signals.log import Array
    from plant_emulator.workflows.axis_files.table import Table

# What a log must hold, and how a user chooses it.
NEEDED = {
    "time": "time=COLUMN:s",
    "position": "position=COLUMN:deg, or velocity=COLUMN:rpm",
    "force": "force=COLUMN:Nm",
}
# A jump is told from a motion where most steps between samples are shorter [rad].
JUMP_ANGLE = 0.5
MECHANICAL = ("position", "velocity", "force", "load")


def read(path: str | Path, columns: Sequence[str] | Mapping[str, str] = ()) -> AxisLog:
    """The run in that file, in SI units.

    columns : NAME=COLUMN[*FACTOR][:UNIT] for columns without an accepted name
    Raises LogError, which says file, line or column, and what was expected.
    """
    path = Path(path)
    if not path.is_file():
        raise LogError(f"{path}: no such file; a log of an axis is needed")
    table, given = _table(path), choices(columns)
    chosen = _choose_columns(table, given)
    kept = {name: _unit(table, choice) for name, choice in chosen.items()}
    rotary = _is_rotary(table, chosen, {name: own for name, (_, own) in kept.items()})
    taken = table.take([choice.column for choice in chosen.values()])
    values = {
        name: _convert(table, choice, found, *kept[name])
        for (name, choice), found in zip(chosen.items(), taken, strict=True)
    }
    time = values.pop("time")
    table.check_increasing(chosen["time"].column, time)
    if "velocity" in values:
        values["position"] = _integral(time, values["velocity"])
    elif rotary:
        values["position"] = _unwrap(values["position"])
    used = {choice.column for choice in chosen.values()}
    sure = frozenset(choice.quantity for choice in (*given, *table.known) if choice.unit)
    log = AxisLog(
        time=time,
        **values,
        rotary=rotary,
        source=str(path),
        other=(*(name for name in table.names if name not in used), *table.others),
        confirmed=sure,
    )
    check_magnitudes(log, {name: c.column for name, c in chosen.items() if name not in sure})
    return log


def _table(path: Path) -> Table:
    data = path.read_bytes()
    if data.startswith(matlab.MAGIC):
        return matlab.table(str(path))
    if mdf4_log.recognises(data) or parquet_log.recognises(data):
        return channels.table(data, str(path))
    return text.table(data, str(path))


def _choose_columns(table: Table, given: Sequence[Choice]) -> dict[str, Choice]:
    """The column of every quantity by its name; a given choice goes before a name of the file."""
    found = {choice.quantity: choice for choice in table.known}
    for name in table.names:
        quantity = quantity_of(name)
        if quantity and quantity not in found:
            found[quantity] = Choice(quantity=quantity, column=name)
    named = {choice.quantity: choice for choice in given}
    found |= named
    if "position" in found and "velocity" in found:
        found.pop("position" if "velocity" in named and "position" not in named else "velocity")
    for quantity, example in NEEDED.items():
        if quantity not in found and not (quantity == "position" and "velocity" in found):
            raise _missing_column(table, quantity, example)
    for name in table.names:
        other = unit_behind(name)
        if other and other[0] in ("load", "temperature") and other[0] not in found:
            raise _in_another_unit(table, name, *other)
    for choice in found.values():
        if choice.column not in table.names:
            raise LogError(
                f"{table.path}: {table.header}: no column {choice.column}; "
                f"it has {', '.join(table.names)}"
            )
    return found


def _missing_column(table: Table, quantity: str, example: str) -> LogError:
    """Error for a quantity without a column, with the choice that the user may have to make."""
    wanted = ("position", "velocity") if quantity == "position" else (quantity,)
    for name in table.names:
        other = unit_behind(name)
        if other and other[0] in wanted:
            return _in_another_unit(table, name, *other)
    accepted = [name for name, (of, _) in ACCEPTED.items() if of in wanted]
    return LogError(
        f"{table.path}: {table.header}: no column for the {quantity}; it has "
        f"{', '.join(table.names)}; {' or '.join(accepted)} is needed, or --column {example}"
    )


def _in_another_unit(table: Table, name: str, quantity: str, unit: str) -> LogError:
    return LogError(
        f"{table.path}: {table.header}: column {name} is in {unit}: say so by "
        f"--column {quantity}={name}:{unit}"
    )


def _unit(table: Table, choice: Choice) -> tuple[str, str]:
    """Unit of a column times its factor, and the unit of the log into which it is converted."""
    words = choice.unit or table.units.get(choice.column) or unit_in(choice.column)
    expected = " or ".join(units.QUANTITIES[choice.quantity])
    if not words:
        raise LogError(
            f"{table.path}: column {choice.column}: no unit is known; write it as in "
            f"--column {choice.text}:{units.QUANTITIES[choice.quantity][-1].replace(' ', '')}"
        )
    own = units.target(choice.quantity, words)
    if own is None:
        raise LogError(
            f"{table.path}: column {choice.column}: {words!r} is no unit of a "
            f"{choice.quantity}; one that converts to {expected} is needed"
        )
    return words, own


def _convert(table: Table, choice: Choice, values: Array, unit: str, own: str) -> Array:
    """Values of a column in the unit of the log."""
    table.check_finite(choice.column, values)
    return units.convert_unit(values * choice.factor, unit, own)


def _is_rotary(table: Table, chosen: Mapping[str, Choice], kept: Mapping[str, str]) -> bool:
    """Whether the axis turns; raises LogError for quantities that do not belong together."""
    turns = {name: "rad" in own or own == "N m" for name, own in kept.items() if name in MECHANICAL}
    if len(set(turns.values())) > 1:
        told = ", ".join(f"{chosen[name].column} in {kept[name]}" for name in turns)
        raise LogError(
            f"{table.path}: {told}: an angle needs a torque and a length a force; a factor such as "
            "2 pi / pitch makes one of the other"
        )
    return all(turns.values())


def _integral(time: Array, velocity: Array) -> Array:
    """The position that the velocity gives, 0 at the start; shape (n,)."""
    means = 0.5 * (velocity[1:] + velocity[:-1])
    return np.concatenate([[0.0], np.cumsum(means * np.diff(time))])


def _unwrap(position: Array) -> Array:
    """Angles without the jumps of an encoder that begins anew each revolution; shape (n,)."""
    within = np.ptp(position) <= 2.0 * np.pi
    slow = np.median(np.abs(np.diff(position))) < JUMP_ANGLE
    return np.unwrap(position) if within and slow else position
