"""Which of the effects that lead the regressions are fitted freely on top of a fit."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.search.confirmation import Trial
from plant_emulator.diagnosis.search.fitted_sets import FittedSets
from plant_emulator.diagnosis.search.screening import promises
from tests.plant_emulator.diagnosis.line import TIME, Line, noisy, runner


@pytest.mark.parametrize(("wave", "fitted"), [(1.0, [("kink",)]), (1.6, [("kink",), ("wave",)])])
def test_effects_that_gain_half_of_the_most_along_the_measured_outputs_are_fitted(
    wave: float, fitted: list[tuple[str, ...]]
) -> None:
    """By hand: 5 |t| gains 2000 5^2 / 24 = 2083, a wave of 1 2000 / 4 = 500, one of 1.6 1280.

    The regressions tell nothing, so that only the led fits can choose.
    """
    y = noisy(2.0 + 3.0 * TIME + 5.0 * abs(TIME) + wave * np.sin(20.0 * TIME))
    model = Line([y], ("cube", "wave", "kink"))
    null = fit_null(model, (0,))
    alike = [
        replace(p, gains={"relations": 60.0}, starts={"relations": p.starts["simulation"]})
        for p in promises(runner(model), null)
    ]
    sets = FittedSets(runner=runner(model), null=null)
    found = sets.fit_on_top(null, alike, 5.0)
    assert [one.effects for one in found] == fitted
    led = {step.effects: step.gain for step in sets.trace if step.action == "led"}
    assert led["kink",] == pytest.approx(2083.0, rel=0.1)
    assert led["wave",] == pytest.approx(500.0 * wave**2, rel=0.1)


def test_effect_whose_simulation_promises_half_of_what_was_reached_is_fitted_too() -> None:
    """What is slow gains little along the measured outputs; this wave is none and gains nothing."""
    y = noisy(2.0 + 3.0 * TIME + 5.0 * abs(TIME))
    model = Line([y], ("kink", "wave"))
    null = fit_null(model, (0,))
    for promised, fitted in ((900.0, [("kink",)]), (1100.0, [("kink",), ("wave",)])):
        supposed = [
            replace(p, gains={"simulation": promised}) if p.effect == "wave" else p
            for p in promises(runner(model), null)
        ]
        sets = FittedSets(runner=runner(model), null=null)
        assert [one.effects for one in sets.fit_on_top(null, supposed, 5.0)] == fitted


@pytest.mark.parametrize(
    ("promised", "fitted"), [(1900.0, [("kink",)]), (2300.0, [("kink",), ("wave",)])]
)
def test_effect_of_which_a_regression_promises_more_than_was_reached_is_fitted_too(
    promised: float, fitted: list[tuple[str, ...]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """By hand: 5 |t| gains 2083. The wave gains nothing along the measured outputs.

    It is fitted for as many iterations as the leader.
    """
    model = Line([noisy(2.0 + 3.0 * TIME + 5.0 * abs(TIME))], ("kink", "wave"))
    null = fit_null(model, (0,))
    supposed = [
        replace(p, gains={"relations": promised}, starts={"relations": p.starts["simulation"]})
        if p.effect == "wave"
        else p
        for p in promises(runner(model), null)
    ]
    sets = FittedSets(runner=runner(model), null=null)
    asked: list[int | None] = []
    confirm = sets.confirm

    def noting(trials: Sequence[Trial]) -> list[FitResult]:
        asked.extend(trial.iterations for trial in trials)
        return confirm(trials)

    monkeypatch.setattr(sets, "confirm", noting)
    assert [one.effects for one in sets.fit_on_top(null, supposed, 5.0)] == fitted
    assert asked == [10] * len(fitted)


def test_all_effects_are_fitted_on_top_of_a_fit_that_leaves_noise() -> None:
    model = Line([noisy(2.0 + 3.0 * TIME + 0.3 * abs(TIME))], ("wave", "kink"))
    null = fit_null(model, (0,))
    assert null.mean_square <= NOISE_MEAN_SQUARE
    sets = FittedSets(runner=runner(model), null=null)
    found = sets.fit_on_top(null, promises(runner(model), null), 5.0)
    assert {one.effects for one in found} == {("wave",), ("kink",)}


@pytest.mark.parametrize(("later", "kept"), [(4.0, ("kink", "wave")), (1.5, ("wave",))])
def test_refuted_set_is_fitted_without_its_first_effect(
    later: float, kept: tuple[str, ...]
) -> None:
    """The wave was never fitted alone. Beside a kink the runs must agree on it, alone not."""
    wave = np.sin(20.0 * TIME)
    model = Line([noisy(k * wave + 2.0 * abs(TIME)) for k in (4.0, later)], ("kink", "wave"))
    null = fit_null(model, (0, 1))
    both = fit(model, ("kink", "wave"), (0, 1), {"a": 0.0, "b": 0.0}, [{}, {}])
    sets = FittedSets(runner=runner(model), null=null)
    sets.sets = {frozenset(): null, frozenset(both.effects): both}
    assert sets.settled().effects == kept
    reduced = [step.effects for step in sets.trace if step.action == "reduced"]
    assert reduced == ([] if len(kept) > 1 else [("wave",)])
