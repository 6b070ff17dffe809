"""Whether the runs agree on the size of an effect, against hand calculations."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.search.confirmation import Reduction
from plant_emulator.diagnosis.search.run_agreement import RunAgreement, run_agreement
from tests.plant_emulator.diagnosis.line import SHAPES, TIME, Line, explained, noisy

WAVE = SHAPES["wave"](TIME)


def agreement(sizes: list[float], names: tuple[str, ...] = ("wave",)) -> RunAgreement:
    """What runs without noise say of the wave that they hold in these sizes."""
    model, runs = Line([size * WAVE for size in sizes], names), tuple(range(len(sizes)))
    found = fit(model, names, runs, {"a": 0.0, "b": 0.0}, [{} for _ in sizes])
    return run_agreement(model, Reduction(found, runs, "wave"))


@pytest.mark.parametrize("sizes", [[3.0, 3.0], [2.0, 2.1, 1.9], [0.02, -0.02]])
def test_equal_sizes_agree(sizes: list[float]) -> None:
    """The law may be wrong by a tenth. Of the last two no size is certain."""
    assert agreement(sizes).probability > 0.1


@pytest.mark.parametrize("difference", [0.5, 1.0])
def test_two_sizes_by_hand(difference: float) -> None:
    """By hand: each run tells its size with the variance 1 / sum(wave^2), beside level and slope,
    which the runs share; the law's error is a tenth of the mean size, 5. What each run leaves is
    correlated and counts for fewer samples, so that they agree a little more.
    """
    variance = 1.0 / float(WAVE @ WAVE) + (0.1 * 5.0) ** 2
    said = agreement([5.0 - difference / 2, 5.0 + difference / 2])
    assert said.runs == 2
    spread = chi2.isf(said.probability, 1)
    assert spread == pytest.approx(difference**2 / (2.0 * variance), rel=0.25)


def test_runs_that_do_not_show_an_effect_say_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """The effect does nothing in two of three runs."""
    model = Line([4.0 * WAVE, 0.0 * WAVE, 0.0 * WAVE], ("wave",))
    residual = model.residual
    monkeypatch.setattr(model, "residual", lambda run, names: residual(run, () if run else names))
    found = fit(model, ("wave",), (0, 1, 2), {"a": 0.0, "b": 0.0}, [{}, {}, {}])
    said = run_agreement(model, Reduction(found, (0, 1, 2), "wave"))
    assert said == RunAgreement(probability=pytest.approx(1.0), runs=1)


@pytest.mark.parametrize(("later", "agree"), [(4.0, True), (1.0, False)])
def test_a_single_run_has_two_halves(later: float, agree: bool) -> None:
    """The wave grows or stays within the run."""
    model = Line([noisy(np.where(TIME < 0.0, 4.0, later) * WAVE)], ("wave",))
    found = fit(model, ("wave",), (0,), {"a": 0.0, "b": 0.0}, [{}])
    said = run_agreement(model, Reduction(found, (0,), "wave"))
    assert (said.probability > 0.01) == agree


@pytest.mark.parametrize(
    ("sizes", "named"), [((1.5, 1.5), ("cube", "wave")), ((0.4, 2.6), ("cube",))]
)
def test_a_second_effect_has_one_size_in_all_runs(
    sizes: tuple[float, float], named: tuple[str, ...]
) -> None:
    """The same sum of sizes in both: what the runs do not agree on is no second effect."""
    measured = [noisy(30.0 * TIME**3 + size * WAVE, k) for k, size in enumerate(sizes)]
    found = explained(Line(measured, ["cube", "wave"]))
    assert found.final.effects == named
    refused = "the runs do not confirm it" in [step.action for step in found.trace]
    assert refused == (len(named) == 1)


@pytest.mark.parametrize(
    ("large", "exact", "named"),
    [
        (8.0, False, ("cube", "wave")),
        (30.0, False, ("cube",)),
        (30.0, True, ("cube", "wave")),
    ],
)
def test_an_effect_of_a_single_run_closes_more_than_a_law_leaves(
    monkeypatch: pytest.MonkeyPatch, large: float, exact: bool, named: tuple[str, ...]
) -> None:
    """By hand: level and slope leave 4/175 a^2 of each sample of a cube a x^3, so that in two runs
    it closes 5900 or 82000 squares, of which a hundredth is 59 or 820. A wave of 0.5 in one of
    them closes 2000 * 0.25 / 2 = 250.
    """
    measured = [noisy(large * TIME**3 + size * WAVE, k) for k, size in enumerate((0.5, 0.0))]
    model = Line(measured, ["cube", "wave"])
    residual = model.residual
    monkeypatch.setattr(
        model,
        "residual",
        lambda run, names: residual(run, [n for n in names if not (run and n == "wave")]),
    )
    model.candidates["cube"] = replace(model.candidates["cube"], exact_form=exact)
    assert explained(model).final.effects == named
