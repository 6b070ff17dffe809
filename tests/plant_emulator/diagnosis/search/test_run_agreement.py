"""Whether the runs agree on the size of an effect, against hand calculations."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import isfinite

import numpy as np
import pytest
from scipy.stats import chi2

from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.joint_fit import fit, linearise
from plant_emulator.diagnosis.search.confirmation import Reduction
from plant_emulator.diagnosis.search.run_agreement import _split, run_agreement
from plant_emulator.diagnosis.search.search import Search
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import (
    SHAPES,
    TIME,
    Line,
    explained,
    linear,
    noisy,
    runner,
)

WAVE = SHAPES["wave"](TIME)


def agreement(sizes: list[float], names: tuple[str, ...] = ("wave",)) -> float:
    """Probability of runs that hold the wave in these sizes."""
    measured = [noisy(size * WAVE, k) for k, size in enumerate(sizes)]
    model, runs = Line(measured, names), tuple(range(len(sizes)))
    found = fit(model, names, runs, {"a": 0.0, "b": 0.0}, [{} for _ in sizes])
    return run_agreement(model, Reduction(found, runs, "wave"))


@pytest.mark.parametrize("sizes", [[3.0, 3.0], [2.0, 2.1, 1.9], [0.02, -0.02]])
def test_equal_sizes_agree(sizes: list[float]) -> None:
    """The law may be wrong by three tenths. Of the last two no size is certain."""
    assert agreement(sizes) > 0.01


@pytest.mark.parametrize("difference", [1.0, 2.0])
def test_two_sizes_by_hand(difference: float) -> None:
    """By hand: each run tells its size with the variance 1 / sum(wave^2), beside level and slope,
    which the runs share; the law's error is three tenths of the mean size, 5.
    """
    variance = 1.0 / float(WAVE @ WAVE) + (0.3 * 5.0) ** 2
    spread = chi2.isf(agreement([5.0 - difference / 2, 5.0 + difference / 2]), 1)
    assert spread == pytest.approx(difference**2 / (2.0 * variance), rel=0.2)


class Twofold(Line):
    """A wave and a cosine of another rate are two sizes of one effect."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        plain, cosine = super().residual(run, effects), np.cos(37.0 * TIME)
        return lambda v: plain(v) - v["cosine_size"] * cosine


@pytest.mark.parametrize("size", [0.1, 5.0])
def test_one_size_may_follow_what_the_law_of_all_sizes_lacks(size: float) -> None:
    """By hand: each run tells its cosine with the variance 1 / sum(cos^2). The law's error is three
    tenths of what both change, and both are equally long.
    """
    cosines = (0.2, 2.2)
    measured = [noisy(size * WAVE + c * np.cos(37.0 * TIME), k) for k, c in enumerate(cosines)]
    model = Twofold(measured, ("wave",))
    own = model.candidates["wave"]
    model.candidates["wave"] = replace(
        own,
        sizes=(*own.sizes, linear("cosine_size")),
        neutral={**own.neutral, "cosine_size": 0.0},
        units={**own.units, "cosine_size": "1"},
    )
    found = fit(model, ("wave",), (0, 1), {"a": 0.0, "b": 0.0}, [{}, {}])
    spread = chi2.isf(run_agreement(model, Reduction(found, (0, 1), "wave")), 1)
    variance = 1e-3 + 0.3**2 * (size**2 + 1.2**2)
    assert spread == pytest.approx(2.0**2 / (2.0 * variance), rel=0.1)


def test_runs_that_do_not_show_an_effect_say_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """The effect does nothing in two of three runs."""
    model = Line([4.0 * WAVE, 0.0 * WAVE, 0.0 * WAVE], ("wave",))
    residual = model.residual
    monkeypatch.setattr(model, "residual", lambda run, names: residual(run, () if run else names))
    found = fit(model, ("wave",), (0, 1, 2), {"a": 0.0, "b": 0.0}, [{}, {}, {}])
    assert run_agreement(model, Reduction(found, (0, 1, 2), "wave")) > 0.01


@pytest.mark.parametrize("difference", [1.5, 4.0, 16.0])
def test_runs_that_differ_much_do_not_agree(difference: float) -> None:
    """What one common size leaves is no noise: it is the difference that is asked for."""
    sizes = (0.76 - difference / 2, 0.76 + difference / 2)
    model = Line([noisy(size * WAVE, k) for k, size in enumerate(sizes)], ("wave",))
    found = fit(model, ("wave",), (0, 1), {"a": 0.0, "b": 0.0}, [{}, {}])
    assert run_agreement(model, Reduction(found, (0, 1), "wave")) < 1e-3


def test_a_size_with_many_narrow_basins_is_not_asked() -> None:
    """Its slope tells nothing of another basin."""
    model = Line([noisy(size * WAVE, k) for k, size in enumerate((0.4, 3.6))], ("wave",))
    (size,) = model.candidates["wave"].sizes
    model.candidates["wave"] = replace(model.candidates["wave"], sizes=(replace(size, step=0.1),))
    found = fit(model, ("wave",), (0, 1), {"a": 0.0, "b": 0.0}, [{}, {}])
    assert run_agreement(model, Reduction(found, (0, 1), "wave")) == 1.0


def test_runs_that_show_nothing_do_not_hide_two_that_differ(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By hand: sizes of 0.4 and 3.6, 0.3 times 2 and an error of 1 / sqrt(1000) each: 2e-4."""
    sizes = [0.4, 3.6, *[0.0] * 8]
    model = Line([noisy(size * WAVE, k) for k, size in enumerate(sizes)], ("wave",))
    residual = model.residual
    monkeypatch.setattr(
        model, "residual", lambda run, names: residual(run, () if run > 1 else names)
    )
    runs = tuple(range(10))
    found = fit(model, ("wave",), runs, {"a": 0.0, "b": 0.0}, [{}] * 10)
    assert run_agreement(model, Reduction(found, runs, "wave")) < 1e-3


def test_a_prior_that_holds_a_parameter_back_moves_no_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """By hand: the prior 0 +- 0.03 of the slope b holds it at half of the true 0.1: x^2 sums up to
    667 a run, so that two runs know it to 0.027. An odd effect, x^3, stands for the rest in both
    runs alike: each run alone asks for the same size.
    """
    monkeypatch.setattr(Line, "parameters", (linear("a", 0.0), linear("b", 0.0, std=0.03)))
    model = Line([0.1 * TIME + 2.0 * TIME**3] * 2, ("cube",))
    found = fit(model, ("cube",), (0, 1), {"a": 0.0, "b": 0.0}, [{}, {}])
    near = linearise(model, found, (0, 1))
    names = [u.name for u in near.unknowns]
    split = _split(near, names.index("cube_size"), 2.0, ())
    assert split.change == pytest.approx([0.0, 0.0], abs=1e-6)


def test_a_run_alone_tells_its_size_with_its_own_samples() -> None:
    """By hand: 1 / sum(wave^2) beside level and slope, which are shared and orthogonal nearly."""
    model = Line([noisy(3.0 * WAVE, k) for k in range(2)], ("wave",))
    found = fit(model, ("wave",), (0, 1), {"a": 0.0, "b": 0.0}, [{}, {}])
    near = linearise(model, found, (0, 1))
    index = [u.name for u in near.unknowns].index("wave_size")
    split = _split(near, index, 2.0, ())
    assert np.diag(split.covariance) == pytest.approx([1.0 / float(WAVE @ WAVE)] * 2, rel=0.02)
    assert split.inflation == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("others", [0, 2])
@pytest.mark.parametrize(("later", "agree"), [(4.0, True), (1.0, False)])
def test_a_run_that_alone_shows_an_effect_has_two_halves(
    monkeypatch: pytest.MonkeyPatch, others: int, later: float, agree: bool
) -> None:
    """The wave grows or stays within the run; in the others the effect does nothing."""
    shown = noisy(np.where(TIME < 0.0, 4.0, later) * WAVE)
    model = Line([shown, *[noisy(0.0 * WAVE, 1 + k) for k in range(others)]], ("wave",))
    residual = model.residual
    monkeypatch.setattr(model, "residual", lambda run, names: residual(run, () if run else names))
    runs = tuple(range(1 + others))
    found = fit(model, ("wave",), runs, {"a": 0.0, "b": 0.0}, [{} for _ in runs])
    assert (run_agreement(model, Reduction(found, runs, "wave")) > 0.01) == agree


@pytest.mark.parametrize(("later", "agree"), [(3.0, True), (0.5, False)])
def test_a_wave_with_an_angle_in_each_run_has_one_size_in_both_halves(
    monkeypatch: pytest.MonkeyPatch, later: float, agree: bool
) -> None:
    """Both runs hold the same amplitudes, 3 and the later one, each at an angle of its own."""
    sizes = np.where(TIME < 0.0, 3.0, later)
    model = Line([noisy(sizes * np.sin(20.0 * TIME + angle)) for angle in (0.5, -1.0)], ("wave",))
    angle = replace(linear("wave_angle", 0.0, std=1.8), angle=True)
    model.candidates = {"wave": replace(model.candidates["wave"], states=(angle,))}

    def residual(run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        def of(v: Mapping[str, float]) -> Array:
            wave = v["wave_size"] * np.sin(20.0 * TIME + v["wave_angle"])
            return (model.measured[run] - v["a"] - v["b"] * TIME - wave)[None, :]

        return of

    monkeypatch.setattr(model, "residual", residual)
    start, states = {"a": 0.0, "b": 0.0}, [{"wave_angle": 0.4}, {"wave_angle": -0.9}]
    found = fit(model, ("wave",), (0, 1), start, states)
    assert (run_agreement(model, Reduction(found, (0, 1), "wave")) > 0.01) == agree


def test_a_faint_wave_of_the_last_run_agrees_with_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """By hand: a half tells the size with a variance of 1 / (500 0.03^2) = 2.2, its prior is 4."""
    model = Line([noisy(0.0 * WAVE, k) for k in (0, 1)], ("wave",))
    angle = replace(linear("wave_angle", 0.0, std=1.8), angle=True)
    model.candidates = {"wave": replace(model.candidates["wave"], states=(angle,))}

    def residual(run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        def of(v: Mapping[str, float]) -> Array:
            wave = 0.03 * run * v["wave_size"] * np.sin(20.0 * TIME + v["wave_angle"])
            return (model.measured[run] - v["a"] - v["b"] * TIME - wave)[None, :]

        return of

    monkeypatch.setattr(model, "residual", residual)
    found = fit(model, ("wave",), (0, 1), {"a": 0.0, "b": 0.0}, [{"wave_angle": 0.1}] * 2)
    assert run_agreement(model, Reduction(found, (0, 1), "wave")) > 0.01


@pytest.mark.parametrize(
    ("sizes", "named"), [((1.5, 1.5), ("cube", "wave")), ((0.4, 2.6), ("cube",))]
)
def test_a_second_effect_has_one_size_in_all_runs(
    sizes: tuple[float, float], named: tuple[str, ...]
) -> None:
    """The same sum of sizes in both: what the runs do not agree on is no second effect."""
    measured = [noisy(30.0 * TIME**3 + size * WAVE, k) for k, size in enumerate(sizes)]
    found = explained(Line(measured, ["cube", "wave"]))
    assert isfinite(found.log_odds)
    assert found.final.effects == named
    refuted = any(step.action.startswith("refuted by the runs") for step in found.trace)
    assert refuted == (len(named) == 1)


def test_what_the_runs_refute_takes_more_with_it() -> None:
    """A third effect would hide what the runs do not agree on, and a lesser one may be it as well.

    A pair of other effects may not, nor one whose fit has not ended.
    """
    model = Line([noisy(3.0 * TIME**3)], tuple(SHAPES))
    there = runner(model)
    search = Search(declared=there, runner=there, null=fit_null(model, there.runs))
    costs = {
        ("cube",): 300.0,
        ("cube", "wave"): 200.0,
        ("cube", "kink"): 100.0,
        ("cube", "near kink"): 250.0,
        ("kink", "near kink"): 250.0,
        ("cube", "wave", "kink"): 90.0,
    }
    search.sets = {
        frozenset(key): replace(search.null, effects=key, cost=cost, converged=True)
        for key, cost in costs.items()
    }
    search.agreed = {frozenset(("cube", "wave")): False, frozenset(("cube", "kink")): True}
    kept = {frozenset(key) for key in (("cube",), ("cube", "kink"), ("kink", "near kink"))}
    assert set(search.unrefuted) == kept
    lesser = frozenset(("cube", "near kink"))
    search.sets[lesser] = replace(search.sets[lesser], converged=False)
    assert set(search.unrefuted) == {*kept, lesser}
