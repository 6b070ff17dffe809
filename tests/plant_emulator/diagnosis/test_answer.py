"""Parts of the answer of a diagnosis, checked by hand."""

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.explanation import Explanation, Hypothesis
from plant_emulator.diagnosis.machine import MeasuredRun
from plant_emulator.diagnosis.prediction.gap import Prediction, measure_gap
from plant_emulator.diagnosis.prediction.trace import traces
from plant_emulator.diagnosis.report.html.traces import path, rms
from plant_emulator.diagnosis.report.ranking import hypotheses_to_rank, ranked_effect
from plant_emulator.diagnosis.report.shrinkage import noise_floor, nrmsd
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import effect

POINT = FitResult(
    effects=(),
    values={},
    states=({},),
    cost=1000.0,
    sum_of_squares=1000.0,
    samples=1000,
    effective_fraction=1.0,
    standard_errors={},
    converged=True,
)


def hypothesis(effect: str, fall: float) -> Hypothesis:
    """An effect that alone lowers the cost by so much."""
    point = replace(POINT, effects=(effect,), cost=POINT.cost - fall)
    return Hypothesis(
        effect=effect, orthogonal_norm=10.0, total_norm=10.0, confounded_with="a", fit=point
    )


def explanation(falls: dict[str, float], accepted: tuple[str, ...]) -> Explanation:
    return Explanation(
        null=POINT,
        final=replace(POINT, effects=accepted),
        hypotheses=tuple(hypothesis(name, fall) for name, fall in falls.items()),
        alternatives={},
        unconverged="",
        log_odds=0.0,
    )


def test_accepted_effect_without_evidence_alone_is_ranked() -> None:
    """f shows beside a only: alone it lowers the cost least of all."""
    falls = {"f": 1.0, "a": 300.0, "b": 20.0, "c": 15.0, "d": 10.0, "e": 5.0}
    names = [c.effect for c in hypotheses_to_rank(explanation(falls, ("a", "f")))]
    assert names == ["a", "b", "c", "d", "e", "f"]


@pytest.mark.parametrize(("size", "law"), [(4.0, 2.0), (-4.0, 2.0), (0.1, 0.5)])
def test_standard_error_of_a_size_holds_that_of_its_law(size: float, law: float) -> None:
    """By hand: half of the estimate, or of the plausible size 1 where the estimate is smaller."""
    found = explanation({"cube": 300.0}, ("cube",))
    sized = {"values": {"cube_size": size}, "standard_errors": {"cube_size": 0.3}}
    found = replace(found, final=replace(found.final, **sized))
    (one,) = found.hypotheses
    row = ranked_effect(
        one, found, found.named, effect("cube"), model_form_errors={"cube_size": 0.5}
    )
    (told,) = row.parameters
    assert told.standard_error == pytest.approx((0.3**2 + law**2) ** 0.5)


def test_effects_of_no_account_beyond_a_few_are_not_ranked() -> None:
    falls = {"f": 1.0, "a": 300.0, "b": 20.0, "c": 15.0, "d": 10.0, "e": 5.0}
    names = [c.effect for c in hypotheses_to_rank(explanation(falls, ("a",)))]
    assert names == ["a", "b", "c", "d", "e"]


def run(measured: Array, noise: float) -> MeasuredRun:
    return MeasuredRun(
        source="run",
        channels=("y",),
        units=("A",),
        time=np.arange(float(len(measured))),
        measured=measured[None, :],
        noise=np.array([noise]),
        noise_ratio=np.ones((1, len(measured))),
    )


def halves() -> tuple[list[MeasuredRun], list[Prediction]]:
    """Two runs; of the first, from 0 to 990 A, only the second half is held out."""
    early = run(10.0 * np.arange(100.0), noise=2.0)
    late = run(np.linspace(400.0, 700.0, 50), noise=1.0)
    first = np.where(np.arange(100) < 50, 0.0, 3.0)[None, :]
    residuals = (first, np.full((1, 50), 4.0))
    return [early, late], [Prediction(residuals=residuals, converged=True)]


def test_relative_gap_is_pooled_rms_over_the_range_of_held_out_samples() -> None:
    """Residuals of 6 A and 4 A, 50 each: rms sqrt(26) A; held out lie 400 A to 990 A."""
    runs, predictions = halves()
    found = measure_gap(runs, predictions, [10, 10])
    assert nrmsd(found, runs) == {"y": pytest.approx(np.sqrt(26.0) / 590.0)}
    assert noise_floor(found, runs) == {"y": pytest.approx(np.sqrt(2.5) / 590.0)}


def test_fitted_part_of_a_log_is_not_drawn_as_predicted() -> None:
    runs, predictions = halves()
    early, late = traces(runs, predictions, predictions)
    assert np.isnan(early.explained[:50]).all()
    assert early.explained[50:] == pytest.approx(early.measured[50:] - 6.0)
    assert rms(early.measured - early.recalibrated) == pytest.approx(6.0)
    assert late.recalibrated == pytest.approx(late.measured - 4.0)
    drawn = path(early.time, early.recalibrated, 100)
    assert drawn.count("M") == 1
    assert drawn.startswith("M50 ")


def test_channel_without_held_out_samples_is_not_drawn() -> None:
    (early, late), _ = halves()
    none = [Prediction(residuals=(np.zeros((1, 100)), np.ones((1, 50))), converged=True)]
    assert len(traces([early, late], none, none)) == 1
