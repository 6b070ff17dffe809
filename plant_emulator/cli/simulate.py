"""Simulate a program or a logged run, and write the log that the bench would have given."""

from __future__ import annotations

import sys
from typing import Literal

import click

from plant_emulator.cli import _options
from register_maps.command_line.parameters import Command, OutputFile

EXAMPLE = """
\b
Examples:
  plant-emulator simulate --program program1 --out program1.csv
  plant-emulator simulate --program run.csv.gz --effect torque_sensor_lag:time_constant=0.1 \\
      --seed 1 --out lagging.csv
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.option(
    "--program", required=True, metavar="NAME|LOG", help="A program or its file, or a log."
)
@_options.parameters
@_options.effect
@click.option(
    "--seed",
    type=click.IntRange(0),
    help="Add the sensors' noise and quantisation, from this seed.",
)
@_options.reference
@_options.start
@click.option("--out", type=OutputFile(), help="The log to write; default: standard output.")
def command(
    program: str,
    parameters: str,
    effects: tuple[str, ...],
    seed: int | None,
    reference: Literal["linear", "staircase"] | None,
    start: Literal["fit", "middle"],
    out: str | None,
) -> None:
    """Simulate a program (program1-4, program6, program6L, a file of one) or the inputs of a log.

    A log's start position in the backlash gap is fitted to it unless --start middle; a program
    starts in the middle of the gap.
    """
    from plant_emulator import logs
    from plant_emulator.logs import csv
    from plant_emulator.workflows.simulation import simulate

    log = simulate(
        program,
        parameters=parameters,
        effects=effects,
        seed=seed,
        reference=reference,
        start=start,
    )
    if out:
        logs.write(log, out)
        click.echo(f"{out}: {len(log.time)} samples, {log.time[-1]:g} s", err=True)
    else:
        sys.stdout.write(csv.text(log))
