"""Effects of chance course, on a line that shakes in proportion to a known slope."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from plant_emulator.diagnosis.decision.procedure import Procedure
from plant_emulator.diagnosis.diagnose import Diagnose
from plant_emulator.diagnosis.execution.pool import InProcess
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.fitting.random_effects import WeightedRecipe, fit_random_effect
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.machine import Course
from plant_emulator.diagnosis.prediction.held_out import Plan
from plant_emulator.diagnosis.screening.screening import screen
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import (
    TIME,
    Given,
    Line,
    effect,
    linear,
    noisy,
    runner,
)

# How much a shake of the size 1 moves each sample (standard deviation): nothing in the first half.
SLOPE = np.maximum(0.0, TIME) * 6.0


class Shaken(Line):
    """The line; `shake` adds to every sample what its slope and a drawn sequence say."""

    def __init__(
        self, measured: Sequence[Array], names: Sequence[str] = ("wave",), slope: Array = SLOPE
    ) -> None:
        super().__init__(measured, [*names, "shake"])
        self.slope = slope
        course = replace(linear("shake_sequence", 0.0), lower=0.0, upper=1e6)
        shaking = effect("shake")
        sizes = tuple(replace(u, lower=0.0) for u in shaking.sizes)
        self.candidates["shake"] = replace(shaking, sizes=sizes, stochastic=(course,))

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        plain = super().residual(run, [name for name in effects if name != "shake"])

        def residual(v: Mapping[str, float]) -> Array:
            if "shake" not in effects:
                return plain(v)
            drawn = np.random.default_rng(int(v["shake_sequence"])).standard_normal(len(TIME))
            return plain(v) - v["shake_size"] * self.slope * drawn

        return residual


def shaken(size: float, seed: int = 5, slope: Array = SLOPE) -> Array:
    """What a machine's own course adds."""
    drawn = np.random.default_rng(seed).standard_normal(len(TIME))
    return np.asarray(size * slope * drawn)


def found(y: Array):  # type: ignore[no-untyped-def]
    """The unrest of the shake on the line's fit."""
    model = Shaken([y])
    return fit_random_effect(model, Task(base=fit_null(model, [0]), runs=(0,), effect="shake"))


def test_size_and_evidence_of_an_unrest() -> None:
    """By hand: evidence is the sum of a^2 v - log(1 + a^2 v) over the samples, on average."""
    line = 2.0 + 3.0 * TIME
    one = found(noisy(line) + shaken(0.8))
    assert one.consistent
    assert one.size == pytest.approx(0.8, rel=0.15)
    assert one.size == pytest.approx(0.8, abs=4.0 * one.standard_error)
    added = (0.8 * SLOPE) ** 2
    assert one.evidence == pytest.approx(float(np.sum(added - np.log1p(added))), rel=0.3)
    (weights,) = one.weights
    assert weights[0, 0] == 1.0
    assert weights[0, -1] == pytest.approx(1.0 / np.hypot(1.0, 0.8 * 6.0), rel=0.5)


@pytest.mark.parametrize("seed", range(5))
def test_no_unrest_in_noise(seed: int) -> None:
    assert found(noisy(2.0 + 3.0 * TIME, seed)).evidence < 12.0


def test_gap_that_is_as_large_but_not_random_is_no_unrest() -> None:
    ordered = 0.8 * SLOPE * np.sign(np.sin(40.0 * TIME))
    one = found(noisy(2.0 + 3.0 * TIME) + ordered)
    assert one.evidence > 1000.0
    assert not one.consistent


def test_unrest_of_one_run_only_is_no_unrest_of_the_machine() -> None:
    """By hand: each still run loses the sum of log(1 + a^2 v) - a^2 v / (1 + a^2 v)."""
    line = 2.0 + 3.0 * TIME
    model = Shaken([noisy(line, 1), noisy(line, 2), noisy(line, 3) + shaken(0.8)])
    runs = (0, 1, 2)
    one = fit_random_effect(model, Task(base=fit_null(model, runs), runs=runs, effect="shake"))
    assert one.evidence > 1000.0
    assert not one.consistent
    model = Shaken([noisy(line, k) + shaken(0.8, k + 10) for k in runs])
    assert fit_random_effect(
        model, Task(base=fit_null(model, runs), runs=runs, effect="shake")
    ).consistent


def test_gap_that_is_random_elsewhere_is_no_unrest() -> None:
    """The residual is as large at small slopes as at large ones, like that of a coarse signal."""
    drawn = np.random.default_rng(3).standard_normal(len(TIME))
    one = found(noisy(2.0 + 3.0 * TIME) + 3.0 * (TIME > 0.0) * drawn)
    assert one.evidence > 1000.0
    assert not one.consistent


def test_unrest_that_draws_the_fit_to_its_course_is_told_all_the_same() -> None:
    """All shakes of the last eighth go one way, and the line follows them until they weigh less."""
    course = np.where(TIME > 0.75, 8.0 * SLOPE, shaken(8.0))
    one = found(noisy(2.0 + 3.0 * TIME) + course)
    assert one.consistent
    assert one.size == pytest.approx(8.0, rel=0.05)


def test_unrest_of_a_shape_that_is_not_the_usual_one() -> None:
    """The machine's shake shows at small slopes, too; the usual one hardly does there."""

    class Shaped(Shaken):
        def __init__(self, measured: Sequence[Array]) -> None:
            super().__init__(measured)
            power = linear("shake_power", 2.0, std=1.0)
            self.candidates["shake"] = replace(self.candidates["shake"], shapes=(power,))

        def residual(
            self, run: int, effects: Sequence[str]
        ) -> Callable[[Mapping[str, float]], Array]:
            plain = super().residual(run, effects)
            bare = Line.residual(self, run, [name for name in effects if name != "shake"])

            def residual(v: Mapping[str, float]) -> Array:
                still, moved = bare(v), plain(v)
                return still + (moved - still) * SLOPE ** (v.get("shake_power", 1.0) - 1.0)

            return residual

    y = noisy(2.0 + 3.0 * TIME) + shaken(8.0)
    model = Shaped([y])
    one = fit_random_effect(model, Task(base=fit_null(model, [0]), runs=(0,), effect="shake"))
    assert one.consistent
    assert one.shape == {"shake_power": 1.0}
    assert one.size == pytest.approx(8.0, rel=0.1)
    # Neither does the usual one hold nor one of a higher power.
    model.candidates["shake"] = replace(
        model.candidates["shake"], shapes=(linear("shake_power", 2.0),)
    )
    assert not fit_random_effect(
        model, Task(base=fit_null(model, [0]), runs=(0,), effect="shake")
    ).homoscedastic


def test_effect_beside_an_unrest_is_named_with_it() -> None:
    y = noisy(2.0 + 3.0 * TIME + 0.5 * np.sin(20.0 * TIME)) + shaken(0.8)
    model = Shaken([y])
    procedure = Procedure.begin(runner(model))
    explained, verdict, weighted = procedure.run()
    assert (verdict.kind, verdict.effects) == ("effect", ("shake", "wave"))
    assert explained.classes() == [["shake"], ["wave"]]
    assert explained.final.values["wave_size"] == pytest.approx(0.5, abs=0.15)
    # What is compared with these costs has to count in their noise.
    again = fit(
        weighted.recipe.build(), ("wave",), [0], explained.final.values, explained.final.states
    )
    assert again.cost == pytest.approx(explained.final.cost, abs=0.1)


def coloured(size: float) -> Array:
    """Noise that is correlated over some five samples."""
    drawn = np.random.default_rng(8).standard_normal(len(TIME))
    return np.asarray(lfilter([size], [1.0, -0.8], drawn))


@pytest.mark.parametrize(("size", "colour"), [(0.8, 0.0), (10.0, 0.6)])
def test_no_other_effect_is_sought_where_all_is_chance(size: float, colour: float) -> None:
    """Every look at one counts the unrest as noise already, and so beside a coloured noise."""
    looked = []

    class Watched(InProcess):
        def map(self, function, recipe, tasks):  # type: ignore[no-untyped-def]
            if function is screen and tasks:
                looked.append(recipe)
            return super().map(function, recipe, tasks)

    model = Shaken([noisy(2.0 + 3.0 * TIME) + coloured(colour) + shaken(size)])
    procedure = Procedure.begin(runner(model, Watched()))
    assert procedure.run()[1].effects == ("shake",)
    assert looked
    assert all(isinstance(recipe, WeightedRecipe) for recipe in looked)


def test_an_unrest_shows_beside_a_coloured_noise() -> None:
    """In the declared noise the colour is structure, and no course of chance."""
    model = Shaken([noisy(2.0 + 3.0 * TIME) + coloured(1.2) + shaken(4.0)])
    assert not fit_random_effect(
        model, Task(base=fit_null(model, [0]), runs=(0,), effect="shake")
    ).consistent
    assert Procedure.begin(runner(model)).run()[1].effects == ("shake",)


def test_wave_beside_a_great_unrest_is_an_effect_too() -> None:
    """By hand: the half that does not shake tells n/2 0.5^2 / 2 = 125 of the wave [chi squared]."""
    y = noisy(2.0 + 3.0 * TIME + 0.5 * np.sin(20.0 * TIME)) + shaken(8.0)
    found, decision, _ = Procedure.begin(runner(Shaken([y]))).run()
    assert decision.effects == ("shake", "wave")
    assert found.final.values["wave_size"] == pytest.approx(0.5, abs=0.15)


def test_held_out_runs_that_an_unrest_fills_deny_no_effect() -> None:
    """By hand: a wave of 1 closes 0.5 of a gap of 8^2 mean(SLOPE^2) = 384 of the noise."""

    class Unplanned(Shaken):
        def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> Line:
            return self

        def missing_experiments(self, runs: Sequence[int]) -> dict[str, tuple[str, ...]]:
            return {}

    wave = 2.0 + 3.0 * TIME + np.sin(20.0 * TIME)
    model = Unplanned([noisy(wave, seed) + shaken(8.0, seed) for seed in (11, 12, 13)])
    folds = (((1, 2), (0,)), ((0, 2), (1,)), ((0, 1), (2,)))
    plan = Plan(fitted=(0, 1, 2), folds=folds)
    answer = Diagnose(InProcess(), Given(model), plan, settings={}).diagnose().answer
    assert answer.verdict.effects == ("shake", "wave")
    assert answer.gap.closed_fraction is None


def test_no_effect_that_differs_from_run_to_run_is_named_beside_a_random_one() -> None:
    """By hand: a wave of 0.6 in one run and 0.1 in two holds 500 * 0.38 = 190 squares in the halves
    that do not shake, 3 % of all 6000.
    """
    runs = [
        noisy(2.0 + 3.0 * TIME + wave * np.sin(20.0 * TIME), seed) + shaken(3.0, seed)
        for seed, wave in ((11, 0.6), (12, 0.1), (13, 0.1))
    ]
    explained, decision, _ = Procedure.begin(runner(Shaken(runs))).run()
    assert explained.null.mean_square <= NOISE_MEAN_SQUARE
    assert decision.effects == ("shake",)
    assert any(s.action.startswith("refuted by the runs") for s in explained.trace)


def test_wave_of_the_turns_beside_an_unrest_is_no_part_of_it() -> None:
    """By hand: a wave of 0.5 holds n/2 0.5^2 = 125 squares of each run's half that is still."""
    turns = 5.0 * (TIME + 1.0) ** 2

    class Turning(Shaken):
        def course(self, run: int, effects: Sequence[str], values: Mapping[str, float]) -> Course:
            return replace(super().course(run, effects, values), turns=turns)

    still = [noisy(2.0 + 3.0 * TIME, seed) + shaken(0.12, seed) for seed in (11, 12, 13)]
    waved = [y + 0.5 * np.sin(2.0 * np.pi * 7.0 * turns) for y in still]
    assert Procedure.begin(runner(Turning(still))).run()[1].effects == ("shake",)
    decision = Procedure.begin(runner(Turning(waved))).run()[1]
    assert (decision.kind, decision.effects) == ("unknown", ())
    assert "repeats 7 times a turn" in decision.reason


def test_unrest_alone_is_an_effect() -> None:
    model = Shaken([noisy(2.0 + 3.0 * TIME) + shaken(0.8)])
    procedure = Procedure.begin(runner(model))
    assert procedure.run()[1].effects == ("shake",)


def test_spikes_of_a_transmission_are_no_unrest() -> None:
    """A few values are far off where the slope is steep; without the mark that is unrest."""
    y = noisy(2.0 + 3.0 * TIME)
    spikes = np.where(np.arange(len(TIME)) % 28 == 0, shaken(8.0), 0.0)
    procedure = Procedure.begin(runner(Shaken([y + spikes])))
    assert procedure.run()[1].effects == ("shake",)
    assert procedure.with_disturbances().run()[1].kind != "effect"


def test_spikes_that_an_unrest_hides_stand_out_beside_it() -> None:
    """The unrest rises from 1 to 193 over the line; six spikes of 160 are where it is 6 to 20."""
    slope = 0.12 + 12.0 * (TIME + 1.0)
    y = noisy(2.0 + 3.0 * TIME) + shaken(8.0, slope=slope)
    y[[60, 83, 109, 131, 158, 184]] += 160.0
    model = Shaken([y], slope=slope)
    explained, decision, _ = Procedure.begin(runner(model)).with_disturbances().run()
    assert decision.effects == ("shake",)
    assert explained.random_effects[0].size == pytest.approx(8.0, rel=0.05)
    assert explained.noise["y"].outliers == pytest.approx(6 / len(TIME), rel=0.2)


def test_weighted_model_is_another_recipe() -> None:
    model = Shaken([noisy(2.0 + 3.0 * TIME)])
    halves = WeightedRecipe(Given(model), (np.full((1, len(TIME)), 0.5),))
    values = {"a": 0.0, "b": 0.0}
    plain = model.residual(0, ())(values)
    assert halves.build().residual(0, ())(values) == pytest.approx(0.5 * plain)
    assert halves.build().runs is model.runs
    others = {
        halves.digest(),
        Given(model).digest(),
        WeightedRecipe(Given(model), (np.ones(1),)).digest(),
    }
    assert len(others) == 3
