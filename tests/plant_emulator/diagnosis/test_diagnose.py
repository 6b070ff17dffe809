"""A whole diagnosis on a machine so small that it can be checked by hand."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.diagnose import Diagnose, Findings
from plant_emulator.diagnosis.execution.pool import InProcess
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.machine import Course
from plant_emulator.diagnosis.prediction.gap import Fold, predict
from plant_emulator.diagnosis.prediction.held_out import HeldOutRuns, Plan
from plant_emulator.estimation import least_squares
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import SHAPES, TIME, Given, Line, noisy, runner

EACH_IN_TURN = Plan(fitted=(0, 1, 2), folds=(((1, 2), (0,)), ((0, 2), (1,)), ((0, 1), (2,))))


class OnlyInTheFirst(Line):
    """Effects act in the first run only."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        return super().residual(run, effects if run == 0 else ())


class Unplanned(Line):
    """Knows no further run that would tell more."""

    def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> Line:
        """See `Model`."""
        return self

    def missing_experiments(self, runs: Sequence[int]) -> dict[str, tuple[str, ...]]:
        """See `Model`."""
        return {}


class Turning(Line):
    """Turns twenty times, faster and faster."""

    def course(self, run: int, effects: Sequence[str], values: Mapping[str, float]) -> Course:
        """See `Model`."""
        return replace(super().course(run, effects, values), turns=5.0 * (TIME + 1.0) ** 2)


class Wavy(Unplanned):
    """A line with a known wave."""

    KNOWN = 60.0 * np.sin(40.0 * TIME)

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        without = super().residual(run, effects)
        return lambda v: without(v) - self.KNOWN


def diagnosed(model: Line) -> Findings:
    return Diagnose(InProcess(), Given(model), EACH_IN_TURN, settings={}).diagnose()


def test_run_that_alone_shows_the_effect_is_not_predicted_and_named() -> None:
    line = 2.0 + 3.0 * TIME
    effect = 4.0 * np.abs(TIME)
    runs = [noisy(line + effect, 1), noisy(line, 2), noisy(line, 3)]
    found = diagnosed(OnlyInTheFirst(runs, ["kink", "wave"]))
    assert found.answer.verdict.effects == ("kink",)
    assert found.answer.logs.held_out == ("run 1", "run 2")
    assert found.details.notes == ("run 0: shows no shrinkage; the other runs do not show kink",)


def test_wave_of_the_turns_is_no_noise_though_it_is_far_below_it() -> None:
    """A wave of 0.4 times the noise holds 2000 * 0.4^2 / 2 = 160 squares in each run."""
    turns = 5.0 * (TIME + 1.0) ** 2
    runs = [
        noisy(2.0 + 3.0 * TIME + 0.4 * np.sin(2.0 * np.pi * 7.0 * turns + seed), seed)
        for seed in (1, 2, 3)
    ]
    assert diagnosed(Line(runs, ["kink"])).answer.verdict.kind == "parameter"
    verdict = diagnosed(Turning(runs, ["kink"])).answer.verdict
    assert verdict.kind == "unknown"
    assert "what is left of y repeats 7 times a turn" in verdict.statement


def test_hysteresis_of_a_sensor_is_no_noise() -> None:
    """Half width 1: the sensor shows 1 less while the quantity rises, and 1 more while it falls."""
    late = -np.sign(np.cos(40.0 * TIME))
    runs = [noisy(2.0 + Wavy.KNOWN + late, seed) for seed in (1, 2, 3)]
    verdict = diagnosed(Wavy(runs, ["kink"])).answer.verdict
    assert verdict.kind == "unknown"
    assert "what is left of y follows the channel's own value with a hyst" in verdict.statement


def test_wave_of_the_turns_beside_a_far_larger_effect_does_not_deny_it() -> None:
    """Another form of the same cause leaves some of it: 0.4^2 of the wave, 16 of the kink."""
    turns = 5.0 * (TIME + 1.0) ** 2
    runs = [
        noisy(16.0 * np.abs(TIME) + 0.4 * np.sin(2.0 * np.pi * 7.0 * turns + seed), seed)
        for seed in (1, 2, 3)
    ]
    assert diagnosed(Turning(runs, ["kink"])).answer.verdict.effects == ("kink",)


def test_effect_that_every_run_shows_is_predicted_in_all() -> None:
    line, effect = 2.0 + 3.0 * TIME, 4.0 * np.abs(TIME)
    found = diagnosed(Line([noisy(line + effect, seed) for seed in (1, 2, 3)], ["kink", "wave"]))
    assert found.answer.logs.held_out == ("run 0", "run 1", "run 2")
    assert found.details.notes == ()
    assert found.answer.gap.closed_fraction == pytest.approx(1.0, abs=0.05)


def test_runs_that_agree_alone_with_other_values_are_told_as_such() -> None:
    slope = 3.0 * TIME
    levels = (2.0, 2.0, 9.0)
    runs = [noisy(level + slope, seed) for seed, level in enumerate(levels, 1)]
    verdict = diagnosed(Unplanned(runs, ["kink"])).answer.verdict
    assert (verdict.kind, verdict.effects) == ("unknown", ())
    told = re.search(
        r": a is (\S+) \+- \S+ in run [01] and (\S+) \+- \S+ in run 2;", verdict.statement
    )
    assert told is not None
    assert [float(value) for value in told.groups()] == pytest.approx([2.0, 9.0], abs=0.5)


def test_runs_that_do_not_agree_alone_are_not_told_apart() -> None:
    bow = 40.0 * np.sin(5.0 * TIME)
    runs = [noisy(level + bow, seed) for seed, level in enumerate((2.0, 2.0, 9.0), 1)]
    verdict = diagnosed(Unplanned(runs, ["kink"])).answer.verdict
    assert verdict.kind == "unknown"
    assert "each log alone" not in verdict.statement


def test_effect_of_uncertain_size_is_fitted_noted_and_not_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By hand: 3 * 80 squares of the wave are below 5 % of 6000; its law is off by two sizes."""
    monkeypatch.setitem(SHAPES, "late", lambda x: (x > 0.0) * np.sin(31.0 * x))
    monkeypatch.setitem(SHAPES, "wave", lambda x: (x < 0.0) * np.sin(20.0 * x))
    gap = 30.0 * SHAPES["late"](TIME) + 0.4 * SHAPES["wave"](TIME)
    recipe = Given(Unplanned([noisy(gap, seed) for seed in (1, 2, 3)], ["late", "wave"]))
    errors = {"wave_size": 2.0}
    found = Diagnose(
        InProcess(), recipe, EACH_IN_TURN, settings={}, model_form_errors=errors
    ).diagnose()
    assert found.answer.verdict.effects == ("late",)
    assert [one.effect for one in found.answer.ranking if one.accepted] == ["late"]
    assert found.fixed.keys() == {"late", "wave"}
    assert [note.partition(":")[0] for note in found.details.notes] == ["wave"]
    assert found.answer.gap.closed_fraction == pytest.approx(1.0, abs=0.01)


class EachOwnEffect(Line):
    """The kink acts in the first run only, the wave in the second only."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        own = "kink" if run == 0 else "wave"
        return super().residual(run, [name for name in effects if name == own])


def test_nothing_is_said_to_close_where_every_run_lacks_an_effect_of_another() -> None:
    line = 2.0 + 3.0 * TIME
    runs = [noisy(line + 4.0 * np.abs(TIME), 1), noisy(line + 4.0 * np.sin(20.0 * TIME), 2)]
    plan = Plan(fitted=(0, 1), folds=(((1,), (0,)), ((0,), (1,))))
    model = EachOwnEffect(runs, ["kink", "wave"])
    found = Diagnose(InProcess(), Given(model), plan, settings={}).diagnose()
    assert set(found.answer.verdict.effects) == {"kink", "wave"}
    assert found.answer.logs.held_out == ("run 0", "run 1")
    assert found.answer.gap.closed_fraction is None
    assert "closes" not in found.answer.verdict.statement
    assert found.details.notes == (
        "run 0: shows no shrinkage; the other runs do not show kink",
        "run 1: shows no shrinkage; the other runs do not show wave",
    )


def test_both_of_two_effects_have_their_evidence_beside_the_other_and_their_gain() -> None:
    """By hand: of 3 runs of 2000 samples the wave takes 3 n 0.5^2 / 2 = 750, the kink
    3 n 20^2 / 12 = 200e3 (|x| on -1 to 1 less its mean); alone the kink leaves the wave.
    """
    y = 2.0 + 3.0 * TIME + 20.0 * np.abs(TIME) + 0.5 * np.sin(20.0 * TIME)
    model = Line([noisy(y, seed) for seed in (1, 2, 3)], ["kink", "wave"])
    model.candidates["kink"] = replace(model.candidates["kink"], exact_form=True)
    found = diagnosed(model)
    assert set(found.answer.verdict.effects) == {"kink", "wave"}
    entries = {entry.effect: entry for entry in found.answer.ranking}
    assert entries["kink"].evidence == pytest.approx(200e3, rel=0.05)
    assert entries["wave"].evidence == pytest.approx(750.0, rel=0.2)
    assert entries["wave"].held_out_gain == pytest.approx(0.0, abs=0.05)
    assert entries["kink"].held_out_gain == pytest.approx(1.0, abs=0.05)


def test_effect_with_little_evidence_beside_the_best_has_no_gain() -> None:
    line, effect = 2.0 + 3.0 * TIME, 4.0 * np.abs(TIME)
    found = diagnosed(Line([noisy(line + effect, seed) for seed in (1, 2, 3)], ["kink", "wave"]))
    gains = {entry.effect: entry.held_out_gain for entry in found.answer.ranking}
    assert gains["wave"] is None
    assert gains["kink"] == pytest.approx(1.0, abs=0.05)


def fold_of_a_line() -> tuple[Line, Fold]:
    """Two runs of 2 + 3 x; the fit starts at 0."""
    model = Line([noisy(2.0 + 3.0 * TIME, seed) for seed in (1, 2)], [])
    start = replace(fit(model, (), (0,), {}, [{}]), values={"a": 0.0, "b": 0.0})
    return model, Fold(fitted=(0,), predicted=(1,), start=start)


def test_fit_that_runs_out_of_steps_is_taken_up_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three steps lead near the least squares, and not to the knowledge that these are reached."""
    model, fold = fold_of_a_line()
    monkeypatch.setattr(least_squares, "MAX_ITERATIONS", 3)
    assert not fit(model, (), (0,), fold.start.values, [{}]).converged
    found = predict(model, fold)
    assert found.converged
    assert np.std(found.residuals[0]) == pytest.approx(1.0, abs=0.05)


def test_prediction_by_a_fit_that_does_not_end_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    model, fold = fold_of_a_line()
    monkeypatch.setattr(least_squares, "MAX_ITERATIONS", 1)
    found = {(): [predict(model, fold)], ("kink",): [predict(model, fold)]}
    folds = (((0,), (1,)),)
    plan = Plan(fitted=(0,), folds=folds)
    held_out = HeldOutRuns(runner=runner(model), plan=plan)
    assert held_out.convergence_notes(folds, found) == (
        "run 1: predicted by a fit with no effect that did not end",
        "run 1: predicted by a fit with kink that did not end",
    )
