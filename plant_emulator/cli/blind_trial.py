"""Hide effects in simulated logs, diagnose them blindly, unseal and score."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import click

from plant_emulator.cli import _options
from register_maps.command_line.parameters import Command

EXAMPLE = """
\b
Examples:
  plant-emulator blind-trial --cases 80 --seed 1 --out trial
  plant-emulator blind-trial --cases 10 --json trial.json
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.option(
    "--cases", type=click.IntRange(min=1), default=80, show_default=True, help="How many benches."
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=1,
    show_default=True,
    help="What everything hidden is drawn from.",
)
@click.option(
    "--out",
    metavar="DIR",
    help="Folder of the trial; default blind_trial_seed_SEED. One that holds a part is continued.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=os.cpu_count() or 1,
    show_default="all cores",
    metavar="N",
    help="Diagnoses that run side by side.",
)
@_options.json_file
def command(cases: int, seed: int, out: str | None, workers: int, json_file: str | None) -> None:
    """Let the diagnosis be examined by a bench that hides what it has.

    Each case is a bench with drifted parameters and, mostly, an effect of hidden size, simulated by
    another law than the library's. The answers are sealed first: their hashes stand in
    DIR/manifest.json.
    """
    from plant_emulator.blind.summary import lines
    from plant_emulator.cli._progress import progress
    from plant_emulator.workflows.blind_trial.trial import Trial

    path = Path(out or f"blind_trial_seed_{seed}")
    trial = Trial(path, seed, cases)
    manifest = trial.seal()
    click.echo(f"{path}: {cases} answers sealed, SHA-256 of the manifest {manifest}", err=True)
    before = signal.signal(signal.SIGTERM, _interrupt)  # its diagnoses must not outlive the trial
    try:
        with progress() as tell:
            details = trial.run(workers, tell)
    except KeyboardInterrupt:
        click.echo(f"{path}: the same command goes on from here", err=True)
        raise
    finally:
        signal.signal(signal.SIGTERM, before)
    if json_file:
        _options.write_json(trial.answer(details), json_file)
    if json_file != "-":
        click.echo("\n".join([*lines(details, seed), f"All cases: {path / 'cases.csv'}"]))


def _interrupt(_signal: int, _frame: object) -> None:
    raise KeyboardInterrupt
