"""Options that several commands share, and the output of a JSON answer."""

from __future__ import annotations

import json
import os
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click
from click.core import ParameterSource

from register_maps.command_line.parameters import PICTURES, OutputFile

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

parameters = click.option(
    "--parameters",
    default="thesis_table_3_1",
    show_default=True,
    metavar="SET",
    help="Shipped parameter set, or the path of a TOML file.",
)
model = click.option(
    "--model",
    type=click.Choice(["bench", "axis"]),
    default="bench",
    show_default=True,
    help="The machine: the bench, or a single motor-driven axis.",
)
columns = click.option(
    "--column",
    "columns",
    multiple=True,
    metavar="NAME=COLUMN[*FACTOR][:UNIT]",
    help="Column of an axis's files, as in position=enc:deg; may be repeated.",
)
effect = click.option(
    "--effect",
    "effects",
    multiple=True,
    metavar="NAME[:PARAM=VALUE,...]",
    help="Add an effect to the nominal bench; a PARAM left out has its plausible size.",
)
reference = click.option(
    "--reference",
    type=click.Choice(["linear", "staircase"]),
    help="Shape of the reference between its samples; default: staircase with a truck.",
)
start = click.option(
    "--start",
    type=click.Choice(["fit", "middle"]),
    default="fit",
    show_default=True,
    help="fit: each log's backlash gap position and the initial states of the set's effects.",
)
table = click.option("--table", type=OutputFile(), help="Write a CSV file for a spreadsheet.")
plot = click.option(
    "--plot", type=OutputFile(endings=PICTURES), help="Plot measured, simulated and residual (PNG)."
)
json_file = click.option(
    "--json",
    "json_file",
    type=OutputFile(dash=True),
    help="Write the machine-readable answer; - is standard output.",
)


def workers(text: str) -> Callable[[Any], Any]:
    """The option --workers with this help text."""
    return click.option(
        "--workers",
        type=click.IntRange(min=1),
        default=os.cpu_count() or 1,
        show_default="all cores",
        metavar="N",
        help=text,
    )


def refuse_of_another(
    model: Literal["bench", "axis"], of_bench: Mapping[str, str], of_axis: Mapping[str, str]
) -> None:
    """Refuse options that this model would ignore, given by their arguments."""
    given = click.get_current_context().get_parameter_source
    other = "axis" if model == "bench" else "bench"
    for name, option in (of_axis if model == "bench" else of_bench).items():
        if given(name) is not ParameterSource.DEFAULT:
            raise click.UsageError(f"{option} belongs to --model {other}")


def write_json(answer: Any, target: str) -> None:
    """Write an answer to a file, or to standard output for `-`."""
    text = json.dumps(_with_null(answer), indent=2, allow_nan=False)
    if target == "-":
        click.echo(text)
    else:
        Path(target).write_text(text + "\n", encoding="utf-8")


def _with_null(answer: Any) -> Any:
    """The answer with null for infinities and NaN, because JSON has neither (RFC 8259)."""
    if isinstance(answer, dict):
        return {key: _with_null(value) for key, value in answer.items()}
    if isinstance(answer, list | tuple):
        return [_with_null(value) for value in answer]
    return None if isinstance(answer, float) and not isfinite(answer) else answer
