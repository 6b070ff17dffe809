"""Say beforehand what such runs can and cannot show of every effect."""

from __future__ import annotations

import click

from plant_emulator.cli import _options
from register_maps.command_line.parameters import Command

EXAMPLE = """
\b
Examples:
  plant-emulator detectability program1 program2 program3
  plant-emulator detectability run1.csv.gz program4 --json plan.json
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("runs", nargs=-1, required=True, metavar="LOG|PROGRAM...")
@_options.parameters
@_options.reference
@_options.json_file
def command(
    runs: tuple[str, ...], parameters: str, reference: str | None, json_file: str | None
) -> None:
    """Smallest size of every effect that recorded or planned RUNS show together.

    And which effects they cannot tell apart, and what they lack for the rest.
    """
    from plant_emulator.diagnosis.design.detectability import as_answer, detectability
    from plant_emulator.parameter_sets import with_effects
    from plant_emulator.workflows.planned_runs import prepared

    model, point, notes = prepared(runs, with_effects.load(parameters), reference)
    for note in notes:
        click.echo(f"note: {note}", err=True)
    found = detectability(model, point, range(len(runs)))
    rows = sorted(found, key=lambda d: -d.orthogonal_norm)
    effects = [as_answer(d, model.candidates[d.effect]) for d in rows]
    if json_file:
        _options.write_json({"schema": "detectability/1", "effects": effects}, json_file)
    if json_file != "-":
        click.echo("\n".join(_table(effects)))


def _table(effects: list[dict[str, object]]) -> list[str]:
    lines = [f"{'effect':28}{'smallest size that shows':42}cannot be told from, or needs"]
    for entry in effects:
        sizes = entry["smallest_size"]
        units = entry["units"]
        assert isinstance(sizes, dict)
        assert isinstance(units, dict)
        hidden = entry["hidden_up_to"]
        assert isinstance(hidden, dict)
        shown = ", ".join(
            f"{name} {value:.2g} {units[name]}".removesuffix(" 1")
            if value is not None
            else f"{name} > {hidden[name]:.2g} {units[name]}".removesuffix(" 1")
            if name in hidden
            else f"{name}: none"
            for name, value in sizes.items()
        )
        same = entry["class"]
        assert isinstance(same, list)
        remark = ", ".join(same[1:]) or entry["needs"] or ""
        lines.append(f"{entry['effect']!s:28}{shown:42}{remark}".rstrip())
    return lines
