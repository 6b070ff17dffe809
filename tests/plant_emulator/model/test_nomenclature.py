"""The nomenclature beside the model: it names everything, with the units that the code has."""

import re
from pathlib import Path

from plant_emulator.model.parameters import CALCULATED, ParameterSet
from plant_emulator.model.stage import GAP_POSITION, STAGE, STATES
from register_maps.signals import LOG_COLUMNS

PAGE = Path(__file__).parents[3] / "plant_emulator" / "model" / "README.md"
# A bar within a cell, as in |omega|, is escaped.
CELLS = re.compile(r"(?<!\\)\|")


def table(title: str) -> dict[str, list[str]]:
    """The cells of each row of a section's table, by the name in the code: letter, unit, ..."""
    section = PAGE.read_text("utf-8").split(f"## {title}\n")[1].split("\n## ")[0]
    rows = [
        [cell.strip() for cell in CELLS.split(line)[1:-1]]
        for line in section.splitlines()
        if line.startswith("|")
    ]
    return {row[1].strip("`"): [row[0], *row[2:]] for row in rows[2:]}


def test_every_parameter_stands_there_with_its_symbol_unit_and_kind(nominal: ParameterSet) -> None:
    found = table("Parameters")
    assert {name: (row[0], row[1], row[3]) for name, row in found.items()} == {
        p.name: (p.symbol, p.unit, p.kind) for p in nominal
    }
    assert {name for name, row in found.items() if row[3] == "calculated"} == set(CALCULATED)
    assert f"`{GAP_POSITION}`" in PAGE.read_text("utf-8")


def test_states_stand_there_in_their_order() -> None:
    assert list(table("States")) == list(STATES)


def test_every_field_of_the_stage_stands_there() -> None:
    assert list(table("Fields of an implicit stage")) == [n for n in STAGE if n not in STATES]


def test_every_signal_of_a_log_stands_there_with_its_unit() -> None:
    units = {c.signal: "K" if c.unit == "degC" else c.unit for c in LOG_COLUMNS.values()}
    assert {name: row[1] for name, row in table("Signals of a log").items()} == units


def test_every_row_has_unit_and_meaning() -> None:
    for title in ("Parameters", "States", "Signals of a log", "Fields of an implicit stage"):
        for name, row in table(title).items():
            assert all(row[1:]), name
