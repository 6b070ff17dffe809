"""Draft the missing law of cases whose truth is known, and print it beside the truth.

    .venv/bin/python tools/drafts.py labelled FOLDER
    .venv/bin/python tools/drafts.py outside --seed 301

`labelled` takes the cases of labels.tsv (see `practice.py`). The drafts know no effect of the
library, so that every effect is a missing law; `true effect` is what the true effect closes in the
same test. A case without an effect should get no draft. `outside` draws cases of
the blind trial whose effect is in no library.

Where there are two drafts, the emulated bench drives the next run that the diagnosis proposes, with
the best draft as its truth, and with noise. `ln ratio` is the log of the evidence ratio of the two
drafts, before and after that run. All parameters are fitted anew: a run that separates the drafts
raises the ratio, although the parameters may follow.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click
from practice import cases_of
from threadpoolctl import threadpool_limits

from plant_emulator import effects, parameter_sets
from plant_emulator.blind import draw, laws
from plant_emulator.blind.generate import measure, simulate_truth
from plant_emulator.diagnosis.execution.pool import InProcess, TaskRunner, build_model
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.machines.bench import BenchModel, BenchRecipe
from plant_emulator.diagnosis.missing_law.hypothesis_test import DraftedLaw, compare_laws
from plant_emulator.diagnosis.wording import percent
from plant_emulator.model.stage import split_gap_position
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import add_noise
from plant_emulator.simulation.simulate import simulate, values_of
from plant_emulator.solver.kernel import kernel, use_own_effects
from plant_emulator.workflows.diagnosis.drafting import draft
from plant_emulator.workflows.diagnosis.runs import bench_runs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.workflows.diagnosis.drafting import Drafted
    from plant_emulator.workflows.diagnosis.runs import Runs

NOMINAL = parameter_sets.load()
HEAD = (
    "case",
    "hidden",
    "place",
    "draft",
    "closes",
    "bound",
    "true effect",
    "ln ratio",
    "alternatives",
)
# Seed of the noise of the run that separates two drafts.
NOISE_SEED = 1
# Kinds of the first cases of a seed that are looked through for effects outside the library.
CASES = 80


def row(name: str, hidden: str, logs: Sequence[str | Log], folder: Path, true: str = "") -> str:
    """A row of the table; true : effect of the library that the logs hold, if one is known."""
    with threadpool_limits(1):
        runs = bench_runs(logs, (), NOMINAL)
        null = fit_null(BenchModel(runs.fitted, NOMINAL, {}), runs.plan.fitted)
        found = draft(runs, null, InProcess(), folder / name)
        if found is None or not found.drafts:
            told = "-" if found is None or found.bound is None else percent(found.bound.interval[1])
            return f"| {name} | {hidden} | - | no draft | - | {told} | - | - | - |"
        best = found.drafts[0]
        ratios = separation(runs, found)
        cells = (
            name,
            hidden,
            best.place,
            best.form,
            percent(best.held_out_gain or 0.0),
            "-" if best.bound is None else percent(best.bound),
            closed_by(true, runs, null) if true else "-",
            "-" if ratios is None else f"{ratios[0]:.1f} -> {ratios[1]:.1f}",
            "; ".join(f"{one.place}: {one.form}" for one in found.drafts[1:]) or "-",
        )
    return f"| {' | '.join(cells)} |"


def closed_by(effect: str, runs: Runs, null: FitResult) -> str:
    """Share of the held-out gap that an effect of the library closes."""
    runner = TaskRunner(
        pool=InProcess(),
        recipe=runs.recipe,
        model=build_model(runs.recipe),
        runs=runs.plan.fitted,
    )
    law = DraftedLaw(effect=effect, values={}, null=null, runs=runs.plan.fitted)
    (result,) = compare_laws(runner, runs.plan, [law])
    return percent(result.gain or 0.0)


def separation(runs: Runs, found: Drafted) -> tuple[float, float] | None:
    """Log of the evidence ratio of the two best drafts, before and after the next run.

    The best draft is the machine of that run. All parameters are fitted anew. None: one draft only.
    """
    if found.next_program is None:
        return None
    files = tuple(Path(one.file) for one in found.drafts[:2])
    use_own_effects(*(effects.from_file(file) for file in files))
    best, other = found.fits[:2]
    truth = {**values_of(NOMINAL), **best.values, **best.states[-1]}
    values, gap = split_gap_position(truth)
    driven = simulate(inputs_of(found.next_program.inputs()), values, gap_position=gap)
    logged = runs.fitted[0].log.signals
    signals = {name: signal for name, signal in driven.signals.items() if name in logged}
    new = recording(add_noise(Log(driven.time, signals, "next run"), NOISE_SEED))
    recipe = BenchRecipe((*runs.fitted, new), NOMINAL, tuple(effects.names()), files)
    model, last = build_model(recipe), len(runs.fitted)
    costs = []
    for one in (best, other):
        begun = fit(model, one.effects, range(last), one.values, one.states)
        states = [*begun.states, model.initial_states(last, begun.effects, begun.values)]
        ended = fit(model, begun.effects, range(last + 1), begun.values, states)
        costs.append((begun.cost, ended.cost))
    (before, after), (other_before, other_after) = costs
    return (other_before - before) / 2.0, (other_after - after) / 2.0


@click.group()
def main() -> None:
    """Draft the missing law of cases whose truth is known, and print it beside the truth."""
    click.echo(f"| {' | '.join(HEAD)} |\n{'|---' * len(HEAD)}|")


@main.command()
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--only", metavar="CASE", multiple=True, help="These cases only.")
def labelled(folder: Path, only: tuple[str, ...]) -> None:
    """Draft the missing law of the labelled cases of FOLDER."""
    with TemporaryDirectory() as scratch:
        for case in cases_of(folder):
            logs = sorted(map(str, (folder / case.name).glob("program*.csv.gz")))
            hidden = "+".join(sorted(case.effects))
            if len(case.effects) < 2 and (not only or case.name in only):
                click.echo(row(case.name, hidden or case.kind, logs, Path(scratch), hidden))


@main.command()
@click.option("--seed", type=click.IntRange(0), required=True, help="Seed of the cases.")
@click.option("--count", type=click.IntRange(1), default=9, show_default=True)
@click.option("--only", metavar="NUMBER", type=int, multiple=True, help="Of these the ones named.")
def outside(seed: int, count: int, only: tuple[int, ...]) -> None:
    """Draft the laws of effects that are in no library."""
    numbers = [k for k, kind in enumerate(draw.kinds(seed, CASES)) if kind == "outside"][:count]
    if strange := set(only) - set(numbers):
        raise click.BadParameter(f"{min(strange)} is none of {numbers}", param_hint="--only")
    with TemporaryDirectory() as scratch:
        for number in only or numbers:
            use_own_effects(*(laws.load(name) for name in laws.names()))
            case = draw.draw(seed, number, NOMINAL, kernel().effects)
            logs = [
                measure(case, log, run, NOMINAL)
                for run, log in enumerate(simulate_truth(case, NOMINAL))
            ]
            use_own_effects()
            (hidden,) = case.hidden
            told = f"{hidden.effect} ({hidden.subsystem})"
            click.echo(row(f"{seed}: {number}", told, logs, Path(scratch)))
            sys.stdout.flush()


if __name__ == "__main__":
    main()
