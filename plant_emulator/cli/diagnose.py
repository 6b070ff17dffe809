"""Say where a gap between model and bench lies, which effect causes it, how far it shrinks."""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path

import click
from click.core import ParameterSource

from plant_emulator.cli import _options
from register_maps.command_line.parameters import Command, OutputFile

EXAMPLE = """
\b
Examples:
  plant-emulator diagnose program1.csv.gz program2.csv.gz program3.csv.gz --report gap.html
  plant-emulator diagnose run1.csv run2.csv --hold-out run3.csv --save bench.toml
  plant-emulator diagnose --model axis estimation.mat --hold-out validation.mat
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option(
    "--hold-out",
    "held_out",
    multiple=True,
    metavar="LOG",
    help="A run to predict; may be repeated. Without it every log is held out in turn.",
)
@_options.parameters
@click.option(
    "--model",
    type=click.Choice(["bench", "axis"]),
    default="bench",
    show_default=True,
    help="The machine: this bench, or a single motor-driven axis (CSV or MATLAB logs).",
)
@click.option(
    "--without", multiple=True, metavar="EFFECT", help="Take an effect out of the library."
)
@click.option(
    "--effects",
    "own",
    multiple=True,
    metavar="FILE.py",
    help="An effect of your own beside the library; may be repeated.",
)
@_options.reference
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=os.cpu_count() or 1,
    show_default="all cores",
    metavar="N",
    help="Processes that fit side by side.",
)
@click.option("--scheduler", metavar="ADDRESS", help="A Dask scheduler instead, tcp://host:port.")
@click.option(
    "--save", type=OutputFile(), help="Write the parameter set with the accepted effects."
)
@click.option("--report", type=OutputFile(), help="Write a self-contained report.")
@_options.json_file
def command(
    logs: tuple[str, ...],
    held_out: tuple[str, ...],
    parameters: str,
    model: str,
    without: tuple[str, ...],
    own: tuple[str, ...],
    reference: str | None,
    workers: int,
    scheduler: str | None,
    save: str | None,
    report: str | None,
    json_file: str | None,
) -> None:
    """Diagnose the gap that LOGs show against the model.

    The verdict is an effect, a class of effects that these logs cannot tell apart, other
    parameters, nothing, or unknown; how far the gap shrinks is measured on runs not fitted.
    """
    from threadpoolctl import threadpool_limits

    from plant_emulator import parameter_sets
    from plant_emulator.cli._progress import progress
    from plant_emulator.diagnosis.diagnose import Diagnose
    from plant_emulator.diagnosis.report.document import to_json
    from plant_emulator.diagnosis.report.terminal import lines
    from plant_emulator.parameter_sets import with_effects
    from plant_emulator.workflows.diagnosis import (
        axis_loaded,
        calibration,
        laws_apart,
        loaded,
        parameter_set,
    )
    from plant_emulator.workflows.workers import pool_of

    given = with_effects.load(parameters, own)
    if model == "axis":
        _only_of_the_bench()
        run = axis_loaded(logs, held_out, without=without)
    else:
        run = loaded(logs, held_out, given, without=without, own=own, hold=reference)
    settings = {"command": f"plant-emulator {shlex.join(sys.argv[1:])}", **run.settings}
    pool = pool_of(workers, scheduler)
    try:
        with progress() as tell, threadpool_limits(1):
            found = Diagnose(
                pool,
                run.recipe,
                run.plan,
                settings=settings,
                cases=None if model == "axis" else calibration(),
                law_errors=None if model == "axis" else laws_apart(),
                notes=run.notes,
                progress=tell,
            ).diagnose()
    finally:
        pool.close()
    for note in found.details.notes:
        click.echo(f"note: {note}", err=True)
    if save:
        parameter_sets.save(parameter_set(found, given, run.fitted), save)
        _own_in(save, own, found.answer.verdict.effects)
        if found.answer.verdict.kind == "unknown":
            click.echo(
                f"note: {save}: the cause is unknown: no effect is in it, and its parameters may "
                "have moved to imitate one",
                err=True,
            )
    if report:
        from plant_emulator.diagnosis.report.html import html

        Path(report).write_text(html(found.answer, found.details), encoding="utf-8")
    if json_file:
        _options.write_json(to_json(found.answer), json_file)
    if json_file != "-":
        click.echo("\n".join(lines(found.answer)))


def _only_of_the_bench() -> None:
    """Refuse options that would be ignored with a single axis."""
    given = click.get_current_context().get_parameter_source
    options = {"save": "--save", "own": "--effects"}
    options |= {"parameters": "--parameters", "reference": "--reference"}
    for name, option in options.items():
        if given(name) is not ParameterSource.DEFAULT:
            raise click.UsageError(f"{option} belongs to --model bench")


def _own_in(saved: str, own: tuple[str, ...], named: tuple[str, ...]) -> None:
    """Tell of effects in a saved set that the other commands do not know."""
    for file in own:
        if Path(file).stem in named:
            click.echo(
                f"note: {saved}: serve, simulate and validate know {Path(file).stem} once {file} "
                "lies in plant_emulator/effects",
                err=True,
            )
