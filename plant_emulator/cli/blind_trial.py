"""Hide effects in simulated logs, diagnose them blindly, unseal and score them."""

from __future__ import annotations

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
    "--cases", type=click.IntRange(min=1), default=80, show_default=True, help="Number of cases."
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=1,
    show_default=True,
    help="Seed of all hidden values.",
)
@click.option(
    "--out",
    metavar="DIR",
    help="Folder of the trial; default blind_trial_seed_SEED. A started trial is continued.",
)
@_options.workers("Diagnoses that run at once.")
@_options.json_file
def command(cases: int, seed: int, out: str | None, workers: int, json_file: str | None) -> None:
    """Test the diagnosis on simulated benches whose truth is hidden.

    Each case is a bench with parameter deviations and usually with an effect of unknown size.
    Another law than that of the library simulates the effect. The truth of every case is sealed
    before the first diagnosis: its hash is in DIR/manifest.json.
    """
    from plant_emulator.cli._progress import progress
    from plant_emulator.workflows.blind_trial.trial import BlindTrial

    path = Path(out or f"blind_trial_seed_{seed}")
    trial = BlindTrial(path, seed, cases)
    manifest = trial.seal()
    click.echo(f"{path}: {cases} answers sealed, SHA-256 of the manifest {manifest}", err=True)
    # SIGTERM becomes an interrupt, because the diagnoses must end with the trial.
    before = signal.signal(signal.SIGTERM, _interrupt)
    try:
        with progress() as report:
            answer = trial.run(workers, report)
    except KeyboardInterrupt:
        click.echo(f"{path}: the same command continues this trial", err=True)
        raise
    finally:
        signal.signal(signal.SIGTERM, before)
    if json_file:
        _options.write_json(answer.to_json(), json_file)
    if json_file != "-":
        click.echo(f"{answer}\nAll cases: {path / 'cases.csv'}")


def _interrupt(_signal: int, _frame: object) -> None:
    raise KeyboardInterrupt
