"""Measure the error of an effect's size where the machine has another law than the library.

    .venv/bin/python tools/law_errors.py --seed 11 --cases 300 > sizes.csv

The logs are those of the blind trial's cases with a single effect, made with the trial's own law
of that effect. The search of a diagnosis fits the library's law of the effect to them.
"""

from __future__ import annotations

import csv
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from multiprocessing import get_context
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click
from threadpoolctl import threadpool_limits

from plant_emulator import effects, logs, parameter_sets
from plant_emulator.blind import draw, laws, score
from plant_emulator.blind.generate import measure, simulate_truth
from plant_emulator.diagnosis.decision.procedure import Procedure
from plant_emulator.diagnosis.execution.pool import InProcess, TaskRunner, build_model
from plant_emulator.diagnosis.machines.bench import BenchRecipe
from plant_emulator.diagnosis.report.ranking import ranked_effect
from plant_emulator.recordings.recording import recording
from plant_emulator.recordings.shared_noise import with_shared_noise
from plant_emulator.solver.kernel import kernel, use_own_effects
from plant_emulator.workflows.workers import end_with_parent

if TYPE_CHECKING:
    from plant_emulator.blind.case import Case
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording

COLUMNS = ("effect", "parameter", "true", "estimated", "standard_error")


def sizes(seed: int, only: tuple[str, ...], number: int) -> list[dict[str, Any]]:
    """True and estimated sizes of a case's effect.

    Empty for a case without an effect, or with an effect that has no other law.
    """
    if draw.kinds(seed, number + 1)[-1] != "effect":
        return []
    use_own_effects(*(laws.load(name) for name in laws.names()))
    known, nominal = kernel().effects, parameter_sets.load()
    case = draw.draw(seed, number, nominal, known)
    (hidden,) = case.hidden
    if hidden.law == hidden.effect or (only and hidden.effect not in only):
        return []
    others = tuple(name for name in known if name != hidden.effect)
    recipe = BenchRecipe(tuple(_recordings(case, nominal)), nominal, others)
    with threadpool_limits(1):
        model, runs = build_model(recipe), tuple(range(len(case.programs)))
        runner = TaskRunner(pool=InProcess(), recipe=recipe, model=model, runs=runs)
        found, _, _ = Procedure.begin(runner).with_input_noise().with_disturbances().run()
    if not found.named:
        return []
    (hypothesis,) = found.hypotheses
    candidate = model.candidates[hidden.effect]
    sized = ranked_effect(hypothesis, found, found.named, candidate).parameters
    pairs = score.sizes(case.hidden, [hidden.effect], {hidden.effect: sized}, known)
    # An effect with an estimated size of 0 was found by its other parameters.
    return [asdict(one) for one in pairs if one.estimated != 0.0]


def _recordings(case: Case, nominal: ParameterSet) -> list[Recording]:
    """The logs of a case, as a diagnosis reads them."""
    found = []
    with TemporaryDirectory() as folder:
        for run, log in enumerate(simulate_truth(case, nominal)):
            path = f"{folder}/{case.programs[run]}.csv.gz"
            logs.write(measure(case, log, run, nominal), path)
            found.append(recording(logs.read(path)))
    return with_shared_noise(found)


@click.command()
@click.option("--seed", type=click.IntRange(min=0), required=True)
@click.option(
    "--cases", type=click.IntRange(min=1), required=True, help="Number of cases of the seed."
)
@click.option("--workers", type=click.IntRange(min=1), default=2, show_default=True)
@click.option(
    "--only", multiple=True, type=click.Choice(effects.names()), help="Only these effects."
)
def main(seed: int, cases: int, workers: int, only: tuple[str, ...]) -> None:
    """Print a table of true and estimated sizes of effects that follow another law."""
    table = csv.DictWriter(sys.stdout, COLUMNS, extrasaction="ignore", lineterminator="\n")
    table.writeheader()
    with ProcessPoolExecutor(workers, get_context("spawn"), end_with_parent) as pool:
        for found in pool.map(partial(sizes, seed, only), range(cases)):
            table.writerows(found)
            sys.stdout.flush()


if __name__ == "__main__":
    main()
