"""Locate the sim-to-real gap, name the effect that causes it, and tell how far it shrinks."""

from __future__ import annotations

import shlex
import sys
from typing import TYPE_CHECKING, Literal

import click

from plant_emulator.cli import _options
from register_maps.command_line.parameters import Command, OutputFile

if TYPE_CHECKING:
    from plant_emulator.workflows.diagnosis.diagnose import Diagnosis

EXAMPLE = """
\b
Examples:
  plant-emulator diagnose program1.csv.gz program2.csv.gz program3.csv.gz --report gap.html
  plant-emulator diagnose run1.csv run2.csv --hold-out run3.csv --save bench.toml
  plant-emulator diagnose --model axis estimation.mat --hold-out validation.mat
  plant-emulator diagnose --model axis run.csv --column position=enc:deg \\
      --column force=iq*0.40:Nm --hold-out run.csv@12.5:20

Columns of --model axis that need no --column: time_s; position_m, position_rad, velocity_m_s or
velocity_rad_s; force_N or torque_Nm; load_force_N or load_torque_Nm; temperature_degC. The load
acts against the drive. Any other column is chosen by its name: time, position, velocity, force (or
torque), load, temperature. FACTOR may be several, as a torque constant times a gear ratio in
force=iq*0.40*28:Nm; * multiplies, / divides. UNIT is that of the product. A file is text (CSV with
any separator, decimal point or comma), MATLAB up to version 7, Parquet or MDF4. FILE@12.5:20 is a
part of a file in time [s].
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option(
    "--hold-out",
    "held_out",
    multiple=True,
    metavar="LOG",
    help="A log to predict; may be repeated. Without it every log is held out in turn.",
)
@_options.parameters
@_options.model
@click.option(
    "--without", multiple=True, metavar="EFFECT", help="Take an effect out of the library."
)
@click.option(
    "--effects",
    "effect_files",
    multiple=True,
    metavar="FILE.py",
    help="File of your own effect beside the library; may be repeated.",
)
@_options.columns
@click.option(
    "--one-run",
    is_flag=True,
    help="LOGS are parts of one run of an axis; nothing is compared over the joints.",
)
@_options.reference
@_options.workers("Processes that run fits side by side.")
@click.option(
    "--scheduler", metavar="ADDRESS", help="Use the workers of a Dask scheduler, tcp://host:port."
)
@click.option(
    "--save", type=OutputFile(), help="Write the parameter set with the accepted effects."
)
@click.option(
    "--draft/--no-draft",
    default=None,
    help="Draft a missing law whatever the verdict, or never; without this, where the cause is "
    "unknown.",
)
@click.option(
    "--drafts",
    "draft_folder",
    default="drafts",
    show_default=True,
    metavar="DIR",
    help="Folder of the effect files of drafted laws; none of other contents is replaced.",
)
@click.option("--report", type=OutputFile(), help="Write a report as one HTML file.")
@click.option(
    "--next-program",
    type=OutputFile(),
    help="Write the next experiment as a drive program (CSV) for `gateway drive`.",
)
@_options.json_file
def command(
    logs: tuple[str, ...],
    held_out: tuple[str, ...],
    parameters: str,
    model: Literal["bench", "axis"],
    without: tuple[str, ...],
    effect_files: tuple[str, ...],
    columns: tuple[str, ...],
    one_run: bool,
    reference: Literal["linear", "staircase"] | None,
    workers: int,
    scheduler: str | None,
    save: str | None,
    draft: bool | None,
    draft_folder: str,
    report: str | None,
    next_program: str | None,
    json_file: str | None,
) -> None:
    """Diagnose the gap that LOGs show against the model.

    The verdict is an effect, a class of effects that these logs cannot distinguish, parameter
    deviations only, no gap, or an unknown cause. Runs that were not fitted tell how far the gap
    shrinks.
    """
    from plant_emulator.cli._progress import progress
    from plant_emulator.workflows.diagnosis.diagnose import diagnose

    of_bench = {"next_program": "--next-program"}
    of_axis = {"columns": "--column", "one_run": "--one-run"}
    _options.refuse_of_another(model, {**of_bench, "reference": "--reference"}, of_axis)
    with progress() as tell:
        found = diagnose(
            logs,
            hold_out=held_out,
            parameters=parameters,
            model=model,
            without=without,
            effect_files=effect_files,
            reference=reference,
            columns=columns,
            one_run=one_run,
            workers=workers,
            scheduler=scheduler,
            progress=tell,
            draft="unknown" if draft is None else "always" if draft else "never",
            draft_folder=draft_folder,
            settings={"command": f"plant-emulator {shlex.join(sys.argv[1:])}"},
        )
    for note in found.notes:
        click.echo(f"note: {note}", err=True)
    for one in found.answer.drafts or ():
        click.echo(f"note: {one.file}: draft {one.form}", err=True)
    if save:
        _save(found, save)
    if report:
        found.write_report(report)
    if next_program:
        _write_next_program(found, next_program)
    if json_file:
        _options.write_json(found.to_json(), json_file)
    if json_file != "-":
        click.echo(found.to_text())


def _write_next_program(found: Diagnosis, path: str) -> None:
    """Write the next experiment as a drive program, or note why there is none."""
    from plant_emulator.errors import ParameterError
    from plant_emulator.workflows.next_program import write_next_program

    try:
        own = found.drafted.next_program if found.drafted else None
        words = write_next_program(found.answer.verdict.next_experiment, path, own)
    except ParameterError as error:
        click.echo(f"note: {path} not written: {error}", err=True)
    else:
        click.echo(f"note: {path}: {words}; gateway drive {path} -c CONFIG", err=True)


def _save(found: Diagnosis, path: str) -> None:
    """Write the parameter set, and note what its user has to know."""
    from plant_emulator import parameter_sets

    parameter_sets.save(found.parameter_set, path)
    verdict = found.answer.verdict
    if verdict.kind == "unknown" and found.answer.drafts:
        click.echo(f"note: {path}: the cause is unknown; the draft is in it", err=True)
    elif verdict.kind == "unknown":
        click.echo(
            f"note: {path}: the cause is unknown: no effect is in it, and the cause may have "
            "biased its parameters",
            err=True,
        )
