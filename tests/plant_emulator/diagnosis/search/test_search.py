"""The search on a machine so small that it can be checked by hand."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from plant_emulator.diagnosis.answer import Undetectable
from plant_emulator.diagnosis.decision.subsystem import faulty_subsystem
from plant_emulator.diagnosis.decision.verdict import decide
from plant_emulator.diagnosis.execution.pool import TaskRunner
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE, adequate, excess
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.report.ranking import undetectable
from plant_emulator.diagnosis.screening.promise import Promise, Start
from plant_emulator.diagnosis.screening.screening import promises
from plant_emulator.diagnosis.search import search
from plant_emulator.diagnosis.search.search import Search
from plant_emulator.diagnosis.search.summary import not_told_apart
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import (
    SHAPES,
    TIME,
    Line,
    effect,
    explained,
    linear,
    noisy,
    runner,
)


def test_planted_effect_is_named_with_its_size() -> None:
    found = explained(Line([noisy(2.0 + 3.0 * TIME + 0.8 * np.sin(20.0 * TIME))]))
    assert found.final.effects == ("wave",)
    assert found.final.values["wave_size"] == pytest.approx(0.8, abs=0.1)
    # by hand: the fall of the cost is size^2 n / 2
    wave = next(c for c in found.hypotheses if c.effect == "wave")
    assert found.evidence(wave) == pytest.approx(0.8**2 * 1000, rel=0.15)
    assert found.classes() == [["wave"]]


class Touching(Line):
    """A line that touches a stop where its slope is further than a gap from 3.

    The effect is a wave on a slope, so that the slope b moves the other way in a fit.
    """

    def __init__(self, measured: Array, gap: float) -> None:
        super().__init__([measured])
        self.candidates, self.gap = {"wave": effect("wave", 10.0)}, gap

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            size = v["wave_size"] if "wave" in effects else 0.0
            y = v["a"] + v["b"] * TIME + size * (TIME + 0.3 * np.sin(20.0 * TIME))
            beyond = max(0.0, abs(v["b"] + size - 3.0) - self.gap)
            return (self.measured[run] - y - 300.0 * beyond * np.cos(13.0 * TIME))[None, :]

        return residual


@pytest.mark.parametrize("gap", [0.5, 0.05])
def test_gain_of_an_effect_whose_columns_bend_is_predicted(gap: float) -> None:
    """By hand: 2000 (0.3 1.2)^2 / 4 = 65 +- 11. Most of a column at a size of 1 is the stop's.

    In a wide gap the slopes are clean. In a narrow one they are not: no change of the size stays
    off the stop but beside a slope b that makes up for it.
    """
    model = Touching(noisy(2.0 + 3.0 * TIME + 0.36 * np.sin(20.0 * TIME)), gap)
    base = fit(model, (), (0,), {"a": 2.0, "b": 3.0}, [{}])
    (found,) = promises(runner(model), base, None)
    assert found.gain == pytest.approx(65.0, abs=22.0)
    start = found.starts["simulation"].values
    assert start["wave_size"] == pytest.approx(1.2, abs=0.15)
    assert start["b"] == pytest.approx(3.0 - start["wave_size"], abs=0.02)


@pytest.mark.parametrize(
    ("beside_random", "sizes", "names"),
    [
        (False, (0.8, 0.0), {"wave"}),
        (True, (0.8, 0.8), {"wave"}),
        (True, (0.8, 0.0), set()),
        (True, (4.0, 0.0), set()),
    ],
)
def test_effect_beside_a_random_one_has_one_size_in_all_runs(
    beside_random: bool, sizes: tuple[float, float], names: set[str]
) -> None:
    """By hand: a wave of 0.8 gains 2000 0.8^2 / 4 = 320 a run, and leaves squares of 0.3 at most.

    The least gain of a first effect is 15, and 40 beside a random one. Sizes of 0.8 and 0 differ
    by 18 standard errors; they refute no first effect. A wave of 4 leaves squares of 4, far off.
    """
    y = [2.0 + 3.0 * TIME + size * np.sin(20.0 * TIME) for size in sizes]
    model = Line([noisy(one, k) for k, one in enumerate(y)], ["wave"])
    there, null = runner(model), fit_null(model, (0, 1))
    found = Search(declared=there, runner=there, null=null, beside_random=beside_random).explain()
    assert set(found.final.effects) == names


def test_rival_of_a_second_effect_is_fitted_where_little_of_the_gap_is_left() -> None:
    """A cosine of 2 is left beside both, and they differ by a thousandth only.

    Beside a random effect the noise stays as it is, and the cosine does not pass for it.
    """
    y = 2.0 + 3.0 * TIME + 40.0 * np.sin(20.0 * TIME) + 30.0 * np.abs(TIME)
    model = Line([noisy(y + 2.0 * np.cos(37.0 * TIME))], ["wave", "kink", "near kink"])
    there, null = runner(model), fit_null(model, (0,))
    found = Search(declared=there, runner=there, null=null, beside_random=True).explain()
    assert found.final.mean_square > NOISE_MEAN_SQUARE
    assert sorted(map(sorted, found.classes())) == [["kink", "near kink"], ["wave"]]
    sharp = replace(found, margins=dict.fromkeys(found.final.effects, 0.0))
    assert [len(names) for names in sharp.classes()] == [1, 1]


@pytest.mark.parametrize(("left", "largest"), [(0.0, 3), (2.0, 2)])
def test_further_effect_that_leaves_most_is_no_base_for_another_one(
    left: float, largest: int
) -> None:
    """By hand: 2 |t| gains 333, and 3 t^3 206. A cosine of 2 has squares of 4000.

    Beside a random effect the noise stays as it is, and the cosine does not pass for it.
    """
    y = 2.0 + 3.0 * TIME + 40.0 * np.sin(20.0 * TIME) + 2.0 * np.abs(TIME) + 3.0 * TIME**3
    model = Line([noisy(y + left * np.cos(37.0 * TIME))], ["wave", "kink", "cube"])
    there, null = runner(model), fit_null(model, (0,))
    found = Search(declared=there, runner=there, null=null, beside_random=True).explain()
    assert max(len(step.effects) for step in found.trace) == largest


def test_search_goes_on_from_the_sets_that_are_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """No regression shows the wave, as where the fit without effects is far off."""
    model = Line([noisy(2.0 + 3.0 * TIME + 40.0 * np.sin(20.0 * TIME))])
    there, null = runner(model), fit_null(model, (0,))
    known = fit(model, ("wave",), (0,), {**null.values, "wave_size": 39.0}, [{}])
    monkeypatch.setattr(search, "promises", lambda *_: [])
    sets = {frozenset(known.effects): known}
    found = Search(declared=there, runner=there, null=null, sets=sets, beside_random=True).explain()
    assert found.final.effects == ("wave",)


def test_other_effects_are_tried_beside_known_sets() -> None:
    """By hand: the known wave of 1.5 explains 1.1 of some 76; the kink explains the rest."""
    model = Line([noisy(2.0 + 3.0 * TIME + 30.0 * abs(TIME) + 1.5 * np.sin(20.0 * TIME))])
    there, null = runner(model), fit_null(model, (0,))
    known = fit(model, ("wave",), (0,), {**null.values, "wave_size": 1.5}, [{}])
    sets = {frozenset(known.effects): known}
    found = Search(declared=there, runner=there, null=null, sets=sets).explain()
    assert set(found.final.effects) == {"kink", "wave"}


@pytest.mark.parametrize(("size", "score"), [(0.8, "simulation"), (4.0, "observer")])
def test_far_gap_is_screened_along_the_measured_outputs(size: float, score: str) -> None:
    """By hand: a wave of 0.8 leaves squares of 0.3 beside the noise of 1, one of 4 leaves 8."""
    found = explained(Line([noisy(2.0 + 3.0 * TIME + size * np.sin(20.0 * TIME))], ["wave"]))
    first = next(step for step in found.trace if step.action == "confirmed")
    assert set(first.promised) == {score}


@pytest.mark.parametrize(("left", "asked"), [(0.0, []), (2.0, [2.0, 0.0])])
def test_relations_beside_effects_are_also_those_at_nominal_parameters(
    left: float, asked: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """By hand: a cosine of 2 leaves 2 beside the noise of 1. Beside noise none are asked.

    The nominal offset is 0; the fit has 2, and the cause that it lacks may have bent it.
    """
    offsets: list[float] = []
    monkeypatch.setattr(Line, "relations", lambda _, where, *__: offsets.append(where.values["a"]))
    y = 2.0 + 3.0 * TIME + 4.0 * np.sin(20.0 * TIME) + left * np.cos(37.0 * TIME)
    model = Line([noisy(y)])
    wave = fit(model, ("wave",), (0,), {**fit_null(model, (0,)).values, "wave_size": 4.0}, [{}])
    promises(runner(model), wave, wave if left else None)
    assert offsets == pytest.approx(asked, abs=0.2)


def test_second_effect_is_fitted_where_a_part_of_its_gain_is_promised(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By hand: the kink gains 2000 1.2^2 / 24 = 120, and needs 40."""

    def of_25(there: TaskRunner, base: FitResult, led: FitResult | None) -> list[Promise]:
        most = 25.0 if base.effects else np.inf
        found = promises(there, base, led)
        return [replace(p, gains={k: min(v, most) for k, v in p.gains.items()}) for p in found]

    monkeypatch.setattr(search, "promises", of_25)
    y = noisy(2.0 + 3.0 * TIME + 4.0 * np.sin(20.0 * TIME) + 1.2 * np.abs(TIME))
    assert explained(Line([y], ["wave", "kink"])).final.effects == ("wave", "kink")


@pytest.mark.parametrize(("hidden", "named"), [(0.0, ()), (1.2, ("wave",))])
def test_fit_without_effects_that_ended_far_off_is_fitted_anew(
    hidden: float, named: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ends at a = 4 for 2, which a cube is tried for; the wave is seen from a = 2 only."""
    model = Line([noisy(2.0 + 3.0 * TIME + hidden * np.sin(20.0 * TIME))])
    right = fit_null(model, (0,))
    values = {**right.values, "a": 4.0}
    squares = float(np.sum(model.residual(0, ())(values) ** 2))
    wrong = replace(right, values=values, cost=squares, sum_of_squares=squares)

    def promised(there: TaskRunner, base: FitResult, led: FitResult | None) -> list[Promise]:
        if base is not wrong:
            return promises(there, base, led)
        start = Start(values={**values, "cube_size": 1.0}, states=({},))
        return [Promise(effect="cube", gains={"relations": 100.0}, starts={"relations": start})]

    monkeypatch.setattr(search, "promises", promised)
    there = runner(model)
    found = Search(declared=there, runner=there, null=wrong).explain()
    assert [s.gain > 1.0 for s in found.trace if s.action == "fitted anew"].count(True) == 1
    assert found.null.cost == pytest.approx(right.cost)
    assert found.final.effects == named


def test_effect_that_gains_only_by_leaving_a_local_minimum_is_not_named() -> None:
    """By hand: the kink gains 2000 0.36^2 / 24 = 11 of 15. The fit without it ended 0.12 off in a,
    which costs 2000 0.12^2 / 2 = 14 more.
    """
    model = Line([noisy(2.0 + 3.0 * TIME + 0.36 * np.abs(TIME), 4)], ["kink"])
    null = fit_null(model, [0])
    values = {**null.values, "a": null.values["a"] - 0.12}
    (rows,) = model.residual(0, ())(values)
    lost = float(rows @ rows) - null.sum_of_squares
    assert lost == pytest.approx(28.8, rel=0.1)
    off = replace(
        null, values=values, cost=null.cost + lost, sum_of_squares=null.sum_of_squares + lost
    )
    found = KnownNoise(declared=runner(model), runner=runner(model), null=off).explain()
    assert any(step.effects == ("kink",) and step.gain > 15.0 for step in found.trace)
    assert found.final.effects == ()
    assert found.null.cost == pytest.approx(null.cost, abs=0.1)


def test_both_of_two_effects_are_named() -> None:
    y = 2.0 + 3.0 * TIME + 0.8 * np.sin(20.0 * TIME) - 3.0 * TIME**3
    found = explained(Line([noisy(y)]))
    assert set(found.final.effects) == {"wave", "cube"}
    assert [names[0] for names in found.classes()] == list(found.final.effects)
    assert adequate(found.final, found.null)


def test_odds_of_a_set_are_those_against_its_best_rival() -> None:
    """By hand: a wave of size A takes n A^2 / 4 from half the squares, of which the first effect
    needs 15. One more effect than the wave needs 40 and gains next to nothing. Where nothing acts,
    the best effect lacks up to 15.
    """
    for size, odds, about in ((0.3, 0.09 * 500 - 15, 10.0), (3.0, 40.0, 5.0)):
        found = explained(Line([noisy(2.0 + 3.0 * TIME + size * np.sin(20.0 * TIME))]))
        assert found.log_odds == pytest.approx(odds, abs=about)
    assert 5.0 < explained(Line([noisy(2.0 + 3.0 * TIME)])).log_odds < 16.0


def test_sets_that_another_noise_may_put_first_are_kept_in_each_size() -> None:
    """Two effects that tie alone are both kept, though a set of two has the least cost."""
    null = fit_null(Line([noisy(2.0 + 3.0 * TIME)]), (0,))
    costs = {(): 900.0, ("wave",): 500.0, ("cube",): 510.0, ("step",): 700.0, ("wave", "cube"): 300}
    sets = {frozenset(k): replace(null, effects=k, cost=float(c)) for k, c in costs.items()}
    kept = {one.effects for one in not_told_apart(sets)}
    assert kept == {(), ("wave",), ("cube",), ("wave", "cube")}


class KnownNoise(Search):
    """A search in noise that no log is asked for."""

    def _estimate_noise(self, where: FitResult) -> bool:
        return False


def test_effect_that_leaves_most_of_what_the_others_leave_is_not_the_cause() -> None:
    """A wave of 4600, a cube of 375 and 400 of no law of the library, in squares of the noise.

    The two leave 7 % of the gap. The cube leaves 52 % of what the wave leaves, so that it is not
    named. The wave alone leaves 14 %: the cause is unknown.
    """
    rest = np.sqrt(0.2) * np.random.default_rng(7).standard_normal(len(TIME))
    gap = 2.15 * np.sin(20.0 * TIME) + 2.86 * TIME**3 + rest
    model = Line([noisy(2.0 + 3.0 * TIME + gap)], ["wave", "cube"])
    found = KnownNoise(
        declared=runner(model), runner=runner(model), null=fit_null(model, [0])
    ).explain()
    assert found.final.effects == ("wave",)
    assert decide(model, found).kind == "unknown"


def test_step_of_the_estimated_noise_tells_the_fit_in_that_noise() -> None:
    """By hand: in noise of two equal neighbours the squares are twice the declared ones."""
    noise = np.convolve(np.random.default_rng(2).normal(size=2001), np.ones(2), mode="valid")
    found = explained(Line([2.0 + 3.0 * TIME + 40.0 * np.sin(20.0 * TIME) + noise], ["wave"]))
    before, step = next(
        pair for pair in itertools.pairwise(found.trace) if pair[1].action == "noise estimated"
    )
    assert (before.effects, step.effects) == (("wave",), ("wave",))
    assert before.mean_square == pytest.approx(2.0, rel=0.1)
    assert step.mean_square == pytest.approx(1.0, abs=0.1)


def test_two_effects_lie_where_the_larger_share_is() -> None:
    y = 2.0 + 3.0 * TIME + 0.8 * np.sin(20.0 * TIME) - 3.0 * TIME**3
    model = Line([noisy(y)])
    found = decide(model, explained(model))
    for larger, smaller in (("wave", "cube"), ("cube", "wave")):
        shares = {f"part of {larger}": 0.6, f"part of {smaller}": 0.4}
        assert faulty_subsystem(found, model.candidates, shares) == f"part of {larger}"


def of_runs(model: Line) -> Line:
    """The model with a wave that has a value of its own in each run."""
    own = (linear("phase", 0.0, std=1.0),)
    model.candidates["wave"] = replace(model.candidates["wave"], states=own)
    return model


def test_effect_whose_values_of_the_runs_explain_all_is_not_named_without_a_size() -> None:
    """By hand: standard error of the wave's size sqrt(2 / n) = 0.03; 0.01 of it is chance."""
    for size, unsure in ((0.01, ("wave",)), (0.3, ())):
        y = noisy(2.0 + 3.0 * TIME + size * np.sin(20.0 * TIME))
        plain, model = Line([y], ["wave"]), of_runs(Line([y], ["wave"]))
        start = {"wave_size": 1.0}
        assert fit(model, ("wave",), [0], start, [{}]).insignificant == unsure
        assert fit(plain, ("wave",), [0], start, [{}]).insignificant == ()
    model = of_runs(Line([noisy(2.0 + 3.0 * TIME + 0.8 * np.sin(20.0 * TIME))], ["wave"]))
    found = explained(model)
    assert decide(model, found).kind == "effect"
    unsure = replace(found.final, insignificant=("wave",))
    chance = replace(unsure, cost=found.null.cost - 15.0)
    assert decide(model, replace(found, final=chance)).kind == "unknown"


def test_effect_that_explains_more_than_chance_needs_no_certain_size() -> None:
    """A size and values of the runs that trade: neither is certain, but one cannot do without."""
    model = of_runs(Line([noisy(2.0 + 3.0 * TIME + 0.8 * np.sin(20.0 * TIME))], ["wave"]))
    found = explained(model)
    unsure = replace(found.final, insignificant=("wave",))
    assert found.null.cost - unsure.cost > 100.0
    assert decide(model, replace(found, final=unsure)).effects == ("wave",)


def test_size_as_large_as_it_may_be_is_no_certain_one() -> None:
    """0.8 by its making; a bound of 1.0 leaves it certain, one of 0.7 stops it."""
    model = of_runs(Line([noisy(2.0 + 3.0 * TIME + 0.8 * np.sin(20.0 * TIME))], ["wave"]))
    for upper, unsure in ((1.0, ()), (0.7, ("wave",))):
        wave = model.candidates["wave"]
        sizes = tuple(replace(u, upper=upper, start=0.5) for u in wave.sizes)
        model.candidates["wave"] = replace(wave, sizes=sizes)
        assert fit(model, ("wave",), [0], {"wave_size": 0.5}, [{}]).insignificant == unsure


class Capped(Line):
    """The line with a wave that shows next to nothing, and that the wrong way, up to some size."""

    slope = 20.0

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        plain = super().residual(run, effects)

        def residual(v: Mapping[str, float]) -> Array:
            size = v.get("wave_size", 0.0)
            return plain({**v, "wave_size": self.slope * max(0.0, size - 0.45) - 1e-4 * size})

        return residual


@pytest.mark.parametrize(("slope", "at"), [(20.0, 0.51), (2000.0, 0.4506)])
def test_limit_that_small_sizes_do_not_reach_is_found(slope: float, at: float) -> None:
    """By hand: 20 (0.51 - 0.45) = 1.2 of the wave. The size 1.0 makes 11 of it, or 1100."""
    model = Capped([noisy(2.0 + 3.0 * TIME + 1.2 * np.sin(20.0 * TIME))], ["wave", "cube"])
    model.slope = slope
    (size,) = model.candidates["wave"].sizes
    sizes = (replace(size, lower=0.0),)
    model.candidates["wave"] = replace(model.candidates["wave"], sizes=sizes)
    found = explained(model)
    assert found.final.effects == ("wave",)
    assert found.final.values["wave_size"] == pytest.approx(at, abs=0.2 / slope)
    assert found.final.mean_square < NOISE_MEAN_SQUARE


class Partly(Line):
    """The line, whose runs after the second alone show its effects."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        return super().residual(run, effects if run > 1 else ())


def partly(*sizes: float) -> Partly:
    """Runs with waves of these sizes."""
    waves = [2.0 + 3.0 * TIME + size * np.sin(20.0 * TIME) for size in sizes]
    return Partly([noisy(y, seed) for seed, y in enumerate(waves)])


def test_effect_that_acts_in_one_run_of_three_is_named() -> None:
    found = explained(partly(0.0, 0.0, 5.0)).final
    assert found.effects == ("wave",)
    assert found.values["wave_size"] == pytest.approx(5.0, abs=0.1)


# A cube that closes 0.8 of the gap, and what else there is.
CUBE = 40.0 * SHAPES["cube"](TIME)

KINK = SHAPES["kink"](TIME)

RIPPLE = np.sin(7.0 * TIME)

NAMES = ("cube", "wave", "kink")


def test_second_effect_that_the_first_leaves_is_named_with_both_sizes() -> None:
    """By hand: alone, the cube leaves the kink's n 10^2 / 12 beside the noise."""
    found = explained(Line([noisy(CUBE + 10.0 * KINK)], NAMES))
    assert set(found.final.effects) == {"cube", "kink"}
    assert found.final.values["cube_size"] == pytest.approx(40.0, rel=0.02)
    assert found.final.values["kink_size"] == pytest.approx(10.0, rel=0.02)
    alone = {one.effect: one.fit for one in found.hypotheses}
    assert alone["cube"] is not None
    assert alone["cube"].cost == pytest.approx(2000 * (1.0 + 100.0 / 12.0), rel=0.02)
    assert found.alternatives["cube"]["cube"] == found.final.cost


def test_faint_second_effect_beside_an_exact_one_is_named() -> None:
    """Its evidence is about 100, and what both leave is noise."""
    model = Line([noisy(CUBE + 0.8 * KINK)], NAMES)
    model.candidates["cube"] = replace(model.candidates["cube"], exact_form=True)
    found = explained(model)
    assert set(found.final.effects) == {"cube", "kink"}
    assert found.final.mean_square <= NOISE_MEAN_SQUARE


@pytest.mark.parametrize(("amplitude", "names"), [(0.95, {"kink", "waved kink"}), (3.0, set())])
def test_second_cause_is_asked_for_where_the_first_leaves_most_near_the_noise_only(
    monkeypatch: pytest.MonkeyPatch, amplitude: float, names: set[str]
) -> None:
    """By hand: of a wave the kinks close 6 % alone, and all together. It leaves 1.45 or 5.5."""
    monkeypatch.setitem(SHAPES, "waved kink", lambda x: np.abs(x) + 0.1 * np.sin(20.0 * x))
    model = Line([noisy(amplitude * np.sin(20.0 * TIME))], ("kink", "waved kink"))
    found = explained(model)
    assert (set(found.final.effects) if adequate(found.final, found.null) else set()) == names


def beside_a_line(squares: Mapping[str, float]) -> Array:
    """A line, and shapes of these mean squares beside it; without noise."""
    line = np.stack([np.ones_like(TIME), TIME], axis=1)
    y = 2.0 + 3.0 * TIME
    for name, square in squares.items():
        shape = SHAPES[name](TIME)
        beside = shape - line @ np.linalg.lstsq(line, shape, rcond=None)[0]
        y = y + np.sqrt(square) * shape / beside.std()
    return y


@pytest.mark.parametrize(
    ("squares", "ripple", "most"),
    [
        ({"cube": 12.0, "wave": 8.0}, 0.0, 2),
        ({"cube": 8.0, "wave": 6.0, "kink": 6.0}, 0.0, 3),
        ({"cube": 8.0}, 20.0, 1),
    ],
)
def test_second_cause_is_sought_beside_one_that_explains_half_or_leaves_what_another_one_may(
    squares: dict[str, float], ripple: float, most: int
) -> None:
    """Mean squares beside a line: the first one explains 60 % of two causes, 40 % of three. A
    ripple is no effect of the library.
    """
    y = beside_a_line(squares) + np.sqrt(ripple) * RIPPLE
    found = explained(Line([noisy(y)], NAMES))
    assert max(len(one.effects) for one in found.trace) == most
    assert decide(Line([noisy(y)], NAMES), found).kind == ("unknown" if ripple else "effect")


def test_noise_around_the_first_of_two_causes_counts_only_where_it_leaves_noise() -> None:
    """The cube leaves 8 of 20 mean squares. The noise has a correlation of 0.8 from row to row."""
    drawn = np.random.default_rng(3).standard_normal(len(TIME))
    colour = lfilter([0.6], [1.0, -0.8], drawn)
    found = explained(Line([beside_a_line({"cube": 12.0, "wave": 8.0}) + colour], NAMES))
    sites = [set(one.effects) for one in found.trace if one.action == "noise estimated"]
    assert sites == [{"cube", "wave"}]
    assert set(found.final.effects) == {"cube", "wave"}
    assert found.final.mean_square == pytest.approx(1.0, abs=0.1)


def test_set_that_leaves_what_is_random_is_not_expanded() -> None:
    """Where a part of the log is far noisier, chance promises more than a second effect needs."""
    random = 20.0 * np.random.default_rng(8).standard_normal(len(TIME)) * (np.abs(TIME) > 0.8)
    found = explained(Line([noisy(10.0 * CUBE + random)], NAMES))
    assert found.final.effects == ("cube",)
    assert all(len(one.effects) == 1 for one in found.trace)


@pytest.mark.parametrize("measured", [6.0 * RIPPLE, CUBE + 10.0 * KINK + 6.0 * RIPPLE])
def test_ripple_that_no_effect_explains_is_unknown(measured: Array) -> None:
    """Its mean square is 18, alone and beside two effects; the noise has 1."""
    model = Line([noisy(measured)], NAMES)
    there = explained(model)
    found = decide(model, there)
    assert (found.kind, found.effects) == ("unknown", ())
    assert there.reduced_costs == {}


def test_effect_of_chance_course_is_not_tried() -> None:
    model = Line([noisy(2.0 + 3.0 * TIME + 0.8 * np.sin(20.0 * TIME))], ["wave"])
    model.candidates["wave"] = replace(
        model.candidates["wave"], stochastic=(linear("course"),), needs="its course"
    )
    found = explained(model)
    assert found.final.effects == ()
    assert [c.fit for c in found.hypotheses] == [None]
    assert undetectable(found, model.candidates) == (
        Undetectable(effect="wave", reason="its course"),
    )


class Stuck(Line):
    """The line whose fit without effects never ends: a bottomless slope."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        inner = super().residual(run, effects)
        calls = iter(range(10**9))

        def falling(values: Mapping[str, float]) -> Array:
            return inner(values) * (1.0 if effects else 10.0 * 0.99 ** next(calls))

        return falling

    def observer(self, interval: float) -> Line:
        """See `Model`: the line itself."""
        return Line(self.measured, list(self.candidates))


def test_fit_without_effects_that_does_not_converge_is_unknown() -> None:
    model = Stuck([noisy(2.0 + 3.0 * TIME + 0.8 * np.sin(20.0 * TIME))], [])
    found = decide(model, explained(model))
    assert (found.kind, found.effects) == ("unknown", ())
    assert "did not converge" in found.reason


def test_nothing_is_named_where_only_the_line_has_drifted() -> None:
    for seed in range(20):
        found = explained(Line([noisy(5.0 - 4.0 * TIME, seed)]))
        assert found.final.effects == (), seed


def test_effects_that_look_the_same_are_a_class() -> None:
    found = explained(Line([noisy(2.0 + 3.0 * TIME + 2.0 * np.abs(TIME))]))
    assert len(found.final.effects) == 1
    (names,) = found.classes()
    assert set(names) == {"kink", "near kink"}


def test_what_no_effect_explains_stays_unexplained() -> None:
    y = 2.0 + 3.0 * TIME + 2.0 * np.sign(np.sin(7.0 * TIME))
    model = Line([noisy(y)], names=("wave", "cube"))
    assert decide(model, explained(model)).kind == "unknown"


def test_excess_is_what_the_noise_does_not_explain() -> None:
    point = FitResult(
        effects=(),
        values={},
        states=(),
        cost=0.0,
        sum_of_squares=1500.0,
        samples=1000,
        effective_fraction=1.0,
        standard_errors={},
        converged=True,
    )
    assert excess(point) == pytest.approx(1500 - 1050)
    assert excess(replace(point, sum_of_squares=900.0)) == 0.0


@pytest.mark.slow
def test_correlated_residual_takes_evidence_away() -> None:
    """Noise with a memory of 20 samples: shapes fit it by chance, and must hardly be named.

    With white-noise evidence half of such logs would name one.
    """
    random, named = np.random.default_rng(4), 0
    for _ in range(15):
        white = random.standard_normal(len(TIME) + 100)
        slow = np.convolve(white, np.ones(20) / np.sqrt(20.0), mode="valid")[: len(TIME)]
        found = explained(Line([slow]))
        named += bool(found.final.effects) and adequate(found.final, found.null)
    assert named <= 1


def rippled(kink: float, ripple: Array, plausible: float = 0.3) -> Line:
    """A kink and a ripple; plausible : size of the wave, which the ripple may be."""
    model = Line([noisy(2.0 + 3.0 * TIME + kink * np.abs(TIME) + ripple)], ["kink", "wave"])
    model.candidates["wave"] = effect("wave", plausible)
    return model


@pytest.mark.parametrize(
    ("kink", "amplitude", "named"),
    [
        (2.0, 0.35, {"kink", "wave"}),
        (2.0, 0.245, {"kink"}),
        # The size of the first one says nothing.
        (15.0, 0.35, {"kink", "wave"}),
    ],
)
def test_second_effect_in_what_looks_like_noise_needs_its_own_evidence(
    kink: float, amplitude: float, named: set[str]
) -> None:
    """By hand: a ripple of amplitude A takes n A^2 / 2 from 2000 squares, 122 or 60 of them.

    A second effect needs 80.
    """
    model = rippled(kink, amplitude * np.sin(20.0 * TIME))
    assert set(explained(model).final.effects) == named


def test_second_that_leaves_but_noise_closes_all_that_the_first_leaves() -> None:
    """By hand: of 10000 samples of noise with a mean square of 1.04 a ripple of 0.245 takes 300,
    less than half of 300 + 400, but all that is not noise.
    """
    logs = []
    for seed in range(5):
        white = np.random.default_rng(seed).standard_normal(len(TIME))
        ripple = 0.245 * np.sin(20.0 * TIME)
        logs.append(1.02 * white / white.std() + 2.0 + 3.0 * TIME + 2.0 * np.abs(TIME) + ripple)
    model = Line(logs, ["kink", "wave"])
    model.candidates["wave"] = effect("wave", 0.3)
    assert set(explained(model).final.effects) == {"kink", "wave"}


@pytest.mark.parametrize(
    ("beside", "named"), [(0.0, {"kink", "wave"}), (0.25, {"kink", "wave"}), (0.4, {"kink"})]
)
def test_what_takes_but_a_part_of_the_rest_is_no_second_effect(
    beside: float, named: set[str]
) -> None:
    """By hand, in parts of 2000 samples: the kink closes 4 / 12, a ripple of the library 0.09 / 2,
    and one that is not in it 0.0625 / 2 or 0.16 / 2: the first takes 59 or 36 % of both.
    """
    ripple = 0.3 * np.sin(20.0 * TIME) + beside * np.sin(50.0 * TIME)
    assert set(explained(rippled(2.0, ripple)).final.effects) == named


@pytest.mark.parametrize(
    ("beside", "exact", "named"),
    [(0.75, False, {"kink", "wave"}), (0.95, False, {"kink"}), (0.75, True, {"kink"})],
)
def test_what_an_approximate_law_may_leave_speaks_against_no_second_effect(
    beside: float, exact: bool, named: set[str]
) -> None:
    """By hand: the kink closes 2000 20^2 / 12 = 66700, and may leave 667 of them. A ripple of 1.3
    takes 1690. One of no law takes 562 or 902, more than a tenth of both, less 100 for the noise.
    """
    model = rippled(20.0, 1.3 * np.sin(20.0 * TIME) + beside * np.sin(1500.0 * TIME))
    model.candidates["kink"] = replace(model.candidates["kink"], exact_form=exact)
    found = KnownNoise(
        declared=runner(model), runner=runner(model), null=fit_null(model, [0])
    ).explain()
    assert set(found.final.effects) == named
