"""The contest on a machine so small that it can be checked by hand."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest

from plant_emulator.diagnosis.answer import Location, Undetectable
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.elsewhere import (
    from_nominal,
    in_place,
    shaken,
    sifted,
    smoothed,
    vacated,
)
from plant_emulator.diagnosis.fitting.evidence import adequate, excess
from plant_emulator.diagnosis.fitting.explanation import Hypothesis
from plant_emulator.diagnosis.fitting.joint_fit import fit, fit_null, linearise
from plant_emulator.diagnosis.fitting.looks import glance, glance_far, look
from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
from plant_emulator.diagnosis.fitting.signature import signature
from plant_emulator.diagnosis.report.ranking import undetectable
from plant_emulator.diagnosis.selection import rounds as engine
from plant_emulator.diagnosis.selection.contenders import best_of
from plant_emulator.diagnosis.selection.drifts import Drifts
from plant_emulator.diagnosis.selection.restarts import Restarts
from plant_emulator.diagnosis.selection.rules import noise_only
from plant_emulator.diagnosis.selection.stepwise import Contest
from plant_emulator.diagnosis.selection.subsystem import faulty_subsystem
from plant_emulator.diagnosis.selection.verdict import decide
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


def test_signature_is_what_a_line_cannot_follow() -> None:
    """By hand: x^3 minus its best line 3/5 x has the norm sqrt(n (1/7 - 3 (1/5)^2))."""
    model = Line([noisy(2.0 + 3.0 * TIME)])
    base = fit_null(model, [0])
    found = signature(model, "cube", base, [0], NuisanceSpace(linearise(model, base, [0])))
    assert found is not None
    assert found.orthogonal_norm == pytest.approx(np.sqrt(2000 * (1 / 7 - 3 / 25)), rel=0.01)
    assert found.total_norm == pytest.approx(np.sqrt(2000 / 7), rel=0.01)
    assert found.confounded_with == "b"


def test_prior_keeps_drift_from_imitating() -> None:
    model = Line([noisy(2.0 + 3.0 * TIME)])
    free = signature_norm(model)
    model.parameters = (linear("a", 0.0, std=10.0), linear("b", 3.0, prior=3.0, std=1e-4))
    assert signature_norm(model) == pytest.approx(np.sqrt(2000 / 7), rel=0.01)
    assert free < 0.5 * np.sqrt(2000 / 7)


def signature_norm(model: Line) -> float:
    """Norm of the cube's drift-free signature."""
    base = fit_null(model, [0])
    found = signature(model, "cube", base, [0], NuisanceSpace(linearise(model, base, [0])))
    assert found is not None
    return found.orthogonal_norm


def test_planted_effect_is_named_with_its_size() -> None:
    found = explained(Line([noisy(2.0 + 3.0 * TIME + 0.8 * np.sin(20.0 * TIME))]))
    assert found.final.effects == ("wave",)
    assert found.final.values["wave_size"] == pytest.approx(0.8, abs=0.1)
    # by hand: the fall of the cost is size^2 n / 2
    wave = next(c for c in found.hypotheses if c.effect == "wave")
    assert found.evidence(wave) == pytest.approx(0.8**2 * 1000, rel=0.15)
    assert found.classes() == [["wave"]]


def test_both_of_two_effects_are_named() -> None:
    y = 2.0 + 3.0 * TIME + 0.8 * np.sin(20.0 * TIME) - 3.0 * TIME**3
    found = explained(Line([noisy(y)]))
    assert set(found.final.effects) == {"wave", "cube"}
    assert [names[0] for names in found.classes()] == list(found.final.effects)
    assert adequate(found.final, found.null)


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


def test_second_effect_has_to_have_a_size() -> None:
    """Alone one without a certain size stays: the verdict tells that it would do."""
    model = Line([noisy(2.0 + 3.0 * TIME + 0.8 * np.sin(20.0 * TIME))])
    alone = explained(model).final
    unsure = replace(alone, cost=alone.cost - 100.0, insignificant=("wave",))
    beside = replace(unsure, effects=("cube", "wave"))
    of = {"orthogonal_norm": 1.0, "total_norm": 1.0, "confounded_with": ""}
    for first in (unsure, beside):
        best = best_of([Hypothesis(effect="wave", fit=p, **of) for p in (alone, first)])
        assert best is (alone if first is beside else unsure)


class Capped(Line):
    """The line with a wave that shows next to nothing, and that the wrong way, up to some size."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        plain = super().residual(run, effects)

        def residual(v: Mapping[str, float]) -> Array:
            size = v.get("wave_size", 0.0)
            return plain({**v, "wave_size": 20.0 * max(0.0, size - 0.45) - 1e-4 * size})

        return residual


def test_limit_that_small_sizes_do_not_reach_is_found() -> None:
    """By hand: 20 (0.51 - 0.45) = 1.2 of the wave; the next size that is tried makes 3 of it."""
    model = Capped([noisy(2.0 + 3.0 * TIME + 1.2 * np.sin(20.0 * TIME))], ["wave", "cube"])
    (size,) = model.candidates["wave"].sizes
    sizes = (replace(size, lower=0.0),)
    model.candidates["wave"] = replace(model.candidates["wave"], sizes=sizes)
    found = explained(model)
    assert found.final.effects == ("wave",)
    assert found.final.values["wave_size"] == pytest.approx(0.51, abs=0.01)


class Partly(Line):
    """The line, whose runs after the second alone show its effects."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        return super().residual(run, effects if run > 1 else ())


def partly(*sizes: float) -> Partly:
    """Runs with waves of these sizes."""
    waves = [2.0 + 3.0 * TIME + size * np.sin(20.0 * TIME) for size in sizes]
    return Partly([noisy(y, seed) for seed, y in enumerate(waves)])


def drifts(model: Line) -> tuple[list[FitResult], bool]:
    """What the fit without effects starts from."""
    found = Drifts(runner=runner(model))
    return found.of_some(found.of_all())


def test_drift_is_that_of_the_runs_that_need_no_effect() -> None:
    """By hand: what the third run's wave of 5 leaves there is n 5^2 / 2."""
    model = partly(0.0, 0.0, 5.0)
    (base,), needs_none = drifts(model)
    assert needs_none
    two = fit(model, (), [0, 1], {"a": 0.0, "b": 0.0}, [{}, {}])
    assert base.values == pytest.approx(two.values)
    assert len(base.states) == 3
    assert base.sum_of_squares - base.samples == pytest.approx(len(TIME) * 12.5, rel=0.05)
    found = explained(model).final
    assert found.effects == ("wave",)
    assert found.values["wave_size"] == pytest.approx(5.0, abs=0.1)


def test_drift_of_the_runs_that_leave_little_is_where_the_fit_to_all_starts_too() -> None:
    """A kink of 1.5 that no effect makes: two runs leave 1 + 1.5^2 var|x|, more than noise."""
    kinked = [2.0 + 3.0 * TIME + 1.5 * np.abs(TIME)] * 3
    kinked[2] = kinked[2] + 5.0 * np.sin(20.0 * TIME)
    model = Partly([noisy(y, seed) for seed, y in enumerate(kinked)])
    two = fit(model, (), [0, 1], {"a": 0.0, "b": 0.0}, [{}, {}])
    assert two.mean_square == pytest.approx(1.0 + 1.5**2 / 12.0, abs=0.1)
    assert not noise_only(two)
    (base,), needs_none = drifts(model)
    assert not needs_none
    assert base.values == pytest.approx(two.values)
    assert len(base.states) == 3


@pytest.mark.parametrize("sizes", [(0.0, 0.0, 0.0), (0.0, 5.0, 5.0), (0.0, 0.0)])
def test_drift_of_all_runs_or_of_one_is_no_clear_start(sizes: tuple[float, ...]) -> None:
    assert drifts(partly(*sizes)) == ([], False)


def test_runs_that_need_no_effect_each_but_one_together_are_no_clear_start() -> None:
    lines = [level + 3.0 * TIME for level in (2.0, 4.0)]
    wave = 2.0 + 3.0 * TIME + 5.0 * np.sin(20.0 * TIME)
    model = Partly([noisy(y, seed) for seed, y in enumerate([*lines, wave])])
    assert drifts(model) == ([], False)


def test_drift_of_every_run_where_they_leave_much_less_alone() -> None:
    model = Line([noisy(level + 3.0 * TIME, 1) for level in (2.0, 4.0, 6.0)])
    starts, needs_none = drifts(model)
    assert not needs_none
    assert [point.values["a"] for point in starts] == pytest.approx([2.0, 4.0, 6.0], abs=0.1)
    # By hand: what the first one's drift leaves on the others is n (2^2 + 4^2).
    assert starts[0].sum_of_squares - starts[0].samples == pytest.approx(len(TIME) * 20.0, rel=0.05)


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
    found = Contest(runner(model), NAMES, exact=("cube",)).explain()
    assert set(found.final.effects) == {"cube", "kink"}
    assert noise_only(found.final)


@pytest.mark.parametrize("measured", [6.0 * RIPPLE, CUBE + 10.0 * KINK + 5.0 * RIPPLE])
def test_ripple_that_no_effect_explains_is_unknown(measured: Array) -> None:
    """Its mean square is 18 alone, and 12.5 beside two effects; the noise has 1."""
    model = Line([noisy(measured)], NAMES)
    found = decide(model, explained(model))
    assert (found.kind, found.effects) == ("unknown", ())


class Placed(Line):
    """The gap is known to lie where the kink belongs."""

    def locate(self, where: FitResult, runs: Sequence[int]) -> Location:  # type: ignore[override]
        """See `Model`."""
        shares = {"here": 0.8, "there": 0.2}
        return Location(subsystem="here", channel=None, phase=None, shares=shares, cells=())


def test_place_of_the_gap_overrules_no_fit() -> None:
    """The cube closes most, wherever the gap is said to lie."""
    measured = noisy(0.2 * CUBE + 2.0 * KINK + 1.5 * RIPPLE)
    places = {"cube": "there", "wave": "there", "kink": "here"}
    placed = Contest(runner(Placed([measured], NAMES)), NAMES, subsystems=places)
    found, plain = placed.explain().final, explained(Line([measured], NAMES)).final
    assert found.effects == plain.effects == ("cube",)
    assert found.cost == pytest.approx(plain.cost, rel=1e-6)


def test_signature_of_an_effect_below_zero_begins_below_zero() -> None:
    """What is told by size is told for that direction."""
    model = Line([noisy(-0.5 * SHAPES["kink"](TIME))], ("kink",))
    null = fit_null(model, (0,))
    found = signature(model, "kink", null, (0,), NuisanceSpace(linearise(model, null, (0,))))
    assert found is not None
    assert found.start["kink_size"] == -0.6
    sizes = [size for size, _ in found.orthogonal_norms]
    assert sizes == [0.03, 0.1, 0.3, 0.6, 1.0, 2.0]
    # |x| less its mean has a mean square of 1/12 over 2000 samples.
    assert found.orthogonal_norm == pytest.approx((2000 / 12) ** 0.5, rel=2e-3)


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


def test_fit_without_effects_that_does_not_converge_lets_nothing_be_named() -> None:
    model = Stuck([noisy(2.0 + 3.0 * TIME + 0.8 * np.sin(20.0 * TIME))], ["wave"])
    found = decide(model, explained(model))
    assert (found.kind, found.effects) == ("unknown", ())
    assert "without effects did not converge" in found.reason


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
    found = explained(Line([noisy(y)], names=("wave", "cube")))
    assert not adequate(found.final, found.null)


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
    assert excess(point) == pytest.approx(1500 - 1020)
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


def test_contest_is_the_same_whoever_runs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Restarts and polishing do not depend on the order in which answers come."""
    model = Line([noisy(2.0 + 0.8 * np.sin(20.0 * TIME))])
    forward = explained(model)
    model.candidates = dict(reversed(model.candidates.items()))
    assert explained(model).final.effects == forward.final.effects
    monkeypatch.setattr(engine, "POLISHED", 1)
    assert explained(model).final.effects == forward.final.effects


class Wave(Line):
    """y = 8 sin(b x) + effects: valleys in b; a search that ends in a wrong one."""

    parameters = (linear("a", 0.0, std=10.0), linear("b", 5.0, prior=5.0, std=20.0))

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        others = super().residual(run, effects)
        return lambda v: others({**v, "b": 0.0}) - 8.0 * np.sin(v["b"] * TIME)

    def start_values(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        """See `Model`."""
        return {"a": 0.0, "b": 19.0}, [{} for _ in runs]


def test_effect_behind_a_fit_in_a_wrong_valley_is_found_from_the_nominal_parameters() -> None:
    model = Wave([noisy(8.0 * np.sin(5.3 * TIME) + 2.0 * np.abs(TIME))], ["kink"])
    wrong = fit(model, (), [0], *model.start_values([0]))
    assert wrong.mean_square > 10.0
    near = linearise(model, wrong, [0])
    found = signature(model, "kink", wrong, [0], NuisanceSpace(near))
    assert found is not None
    first = glance(model, found, wrong, [0], near)
    assert look(model, ("kink",), [0], first).mean_square > 10.0
    right = from_nominal(model, "kink", wrong, [0])
    assert right.mean_square < 1.1
    assert right.values["kink_size"] == pytest.approx(2.0, abs=0.3)
    assert right.values["b"] == pytest.approx(5.3, abs=0.05)


class Waves(Wave):
    """A slow wave and one ten times as fast share b: ten times as many local minima."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        others = Line.residual(self, run, effects)
        speed = (1.0, 10.0)[run]
        return lambda v: others({**v, "b": 0.0}) - 8.0 * np.sin(speed * v["b"] * TIME)


def test_run_of_many_valleys_comes_in_when_the_others_have_brought_the_values_near() -> None:
    waves = [8.0 * np.sin(5.7 * TIME), 8.0 * np.sin(57.0 * TIME)]
    model = Waves([noisy(y + 2.0 * np.abs(TIME), k) for k, y in enumerate(waves)])
    runs = [0, 1]
    nominal = {"a": 0.0, "b": 5.0, "kink_size": 2.0}
    assert fit(model, ("kink",), runs, nominal, [{}, {}]).mean_square > 10.0
    right = from_nominal(model, "kink", fit(model, (), runs, nominal, [{}, {}]), runs)
    assert right.mean_square < 1.1
    assert right.values["b"] == pytest.approx(5.7, abs=0.01)


def test_fit_without_effects_in_a_wrong_valley_is_left_for_a_better_one() -> None:
    model = Wave([noisy(8.0 * np.sin(5.3 * TIME))], [])
    assert fit(model, (), [0], *model.start_values([0])).mean_square > 10.0
    assert fit_null(model, [0]).mean_square < 1.1


class Hollow(Line):
    """y = a + 10 (b + a bump near b = 2) x: a hollow of the cost at 2, whatever b is in truth."""

    parameters = (linear("a", 0.0, std=10.0), linear("b", 2.0, prior=2.0, std=20.0))

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        others = super().residual(run, effects)

        def residual(v: Mapping[str, float]) -> Array:
            bump = 0.7 * np.exp(-(((v["b"] - 2.0) / 0.05) ** 2))
            return others({**v, "b": 10.0 * (v["b"] + bump)})

        return residual

    def start_values(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        """See `Model`."""
        return {"a": 0.0, "b": 2.0}, [{} for _ in runs]


def test_fit_in_a_small_hollow_starts_again_from_some_way_off() -> None:
    """By hand: in the hollow 10 (3 - 2.7) x is left, of mean square 3; at b = 3 the noise."""
    model = Hollow([noisy(30.0 * TIME)], ["kink"])
    assert fit_null(model, [0]).mean_square == pytest.approx(4.0, abs=0.2)
    found = explained(model)
    assert found.null.values["b"] == pytest.approx(3.0, abs=0.02)
    assert found.final.effects == ()


def test_effect_in_a_small_hollow_starts_again_from_some_way_off() -> None:
    """The fit without the kink may lie in the hollow; with it, b = 3 is found."""
    model = Hollow([noisy(30.0 * TIME + 2.0 * np.abs(TIME))], ["kink", "wave"])
    found = explained(model)
    assert found.final.effects == ("kink",)
    assert found.final.values["b"] == pytest.approx(3.0, abs=0.02)
    assert found.final.values["kink_size"] == pytest.approx(2.0, abs=0.3)


def test_first_look_orders_effects_as_their_fits_do() -> None:
    model = Wave([noisy(8.0 * np.sin(5.3 * TIME) + 2.0 * np.abs(TIME))], ["kink", "wave", "cube"])
    base = fit_null(model, [0])
    near = linearise(model, base, [0])
    looks, fits = {}, {}
    for name in model.candidates:
        shown = signature(model, name, base, [0], NuisanceSpace(near))
        assert shown is not None
        looks[name] = glance(model, shown, base, [0], near)
        fits[name] = fit(model, (name,), [0], shown.start, shown.states)
        assert looks[name].cost < base.cost
        assert looks[name].cost == pytest.approx(fits[name].cost, abs=5.0)
    assert sorted(looks, key=lambda n: looks[n].cost) == sorted(fits, key=lambda n: fits[n].cost)


class Contact(Line):
    """The line, and two samples of 1e4 (c + size of the wave)^2 and ^3: when a contact begins,
    which drift of c puts right for any size of the wave, but not in proportion.
    """

    parameters = (*Line.parameters, linear("c", 0.5, prior=0.5, std=1.0))
    powers: Mapping[int, int] = {700: 2, 701: 3}

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        others = super().residual(run, effects)

        def residual(v: Mapping[str, float]) -> Array:
            begins = v["c"] + (v["wave_size"] if "wave" in effects else 0.0)
            left = others(v)
            for sample, power in self.powers.items():
                left[0, sample] -= 1e4 * begins**power
            return left

        return residual

    def start_values(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        """See `Model`."""
        return {"a": 0.0, "b": 0.0, "c": 0.5}, [{} for _ in runs]


def test_effect_that_moves_a_contact_is_found_though_its_signature_promises_nothing() -> None:
    """By hand: the wave of 0.3 takes 0.3^2 n / 2 = 90 from the squares of 2000 samples. At the
    smallest size, 0.03, drift leaves 1e4 0.03^2 of (1, 3 / 2) across (1, 3 / 4), which is 5.4 in
    two samples, and 5.4^2 > 2 (0.3 0.03) n / 2 = 18.
    """
    y = 2.0 + 3.0 * TIME + 0.3 * np.sin(20.0 * TIME)
    for sample, power in Contact.powers.items():
        y[sample] += 1e4 * 0.5**power
    model = Contact([noisy(y)], ["wave"])
    base = fit_null(model, [0])
    assert base.mean_square < 1.1
    found = signature(model, "wave", base, [0], NuisanceSpace(linearise(model, base, [0])))
    assert found is not None
    assert found.gain < 0.0
    assert found.concentrated
    final = explained(model).final
    assert final.effects == ("wave",)
    assert final.values["wave_size"] == pytest.approx(0.3, abs=0.1)


def test_signature_over_many_samples_is_not_concentrated() -> None:
    """The wave's own norm at the smallest size, by hand: 0.03 sqrt(n / 2) = 9 / 10; of 300: 280."""
    for measure in (1.0, 300.0):
        model = Line([noisy(2.0 + 3.0 * TIME)], ["wave"])
        model.candidates["wave"] = effect("wave", measure)
        base = fit_null(model, [0])
        found = signature(model, "wave", base, [0], NuisanceSpace(linearise(model, base, [0])))
        assert found is not None
        assert not found.concentrated


def test_second_look_starts_from_a_larger_size_with_the_drift_moved_for_it() -> None:
    """By hand: the best line through x^3 is 3/5 x; at three times the size b is 1.8 less."""
    model = Line([noisy(2.4 * TIME + 0.96 * TIME**3)], ["cube"])
    model.candidates = {"cube": effect("cube", 10.0)}
    base = fit_null(model, [0])
    near = linearise(model, base, [0])
    found = signature(model, "cube", base, [0], NuisanceSpace(near))
    assert found is not None
    assert found.far is not None
    assert found.start["cube_size"] == pytest.approx(1.0)
    assert found.far[0]["cube_size"] == pytest.approx(3.0)
    assert found.far[0]["b"] == pytest.approx(base.values["b"] - 0.6 * 3.0, abs=0.02)
    second = glance_far(model, found, base, [0], near)
    assert second is not None
    assert second.values["cube_size"] == pytest.approx(0.96, abs=0.4)
    assert second.cost == pytest.approx(glance(model, found, base, [0], near).cost, abs=0.1)


def rippled(kink: float, ripple: Array, plausible: float = 0.3) -> Line:
    """A kink and a ripple; plausible : size of the wave, which the ripple may be."""
    model = Line([noisy(2.0 + 3.0 * TIME + kink * np.abs(TIME) + ripple)], ["kink", "wave"])
    model.candidates["wave"] = effect("wave", plausible)
    return model


@pytest.mark.parametrize(
    ("kink", "amplitude", "plausible", "named"),
    [
        (2.0, 0.35, 0.3, {"kink", "wave"}),
        (2.0, 0.2, 0.3, {"kink"}),
        # Less or more than what an error of 10 % in the kink would leave, large or small.
        (15.0, 0.25, 0.3, {"kink"}),
        (15.0, 0.25, 3.0, {"kink"}),
        (5.0, 0.25, 2.0, {"kink", "wave"}),
        # Less than a tenth of its plausible size.
        (5.0, 0.25, 3.0, {"kink"}),
    ],
)
def test_second_effect_in_what_looks_like_noise_needs_its_own_evidence(
    kink: float, amplitude: float, plausible: float, named: set[str]
) -> None:
    """By hand: a ripple of amplitude A takes n A^2 / 2 from the squares, 122, 40 or 62 of 2000,
    and with this noise 85; the kink n k^2 / 12, of which 0.01 are 375 or 42.
    """
    model = rippled(kink, amplitude * np.sin(20.0 * TIME), plausible)
    assert set(explained(model).final.effects) == named


@pytest.mark.parametrize(("exact", "named"), [(False, {"kink"}), (True, {"kink", "wave"})])
def test_beside_an_exact_effect_the_share_of_the_gap_says_nothing(
    exact: bool, named: set[str]
) -> None:
    """By hand: the ripple takes 85 from the squares with this noise, less than a thousandth of
    2000 30^2 / 12.
    """
    model = rippled(30.0, 0.25 * np.sin(20.0 * TIME))
    model.candidates["kink"] = replace(model.candidates["kink"], exact_form=exact)
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


def test_effect_in_the_place_of_its_twin_begins_at_the_twins_size() -> None:
    model = Line([noisy(2.0 + 3.0 * TIME + 2.0 * np.abs(TIME))])
    found = fit(model, ("near kink",), [0], {}, [{}])
    tangents = NuisanceSpace(linearise(model, vacated(model, found), [0]))
    _, start = in_place(model, "kink", found, [0], tangents)
    assert start.effects == ("kink",)
    assert set(start.values) == {"a", "b", "kink_size"}
    assert start.values["kink_size"] == 2.0


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
    ("plausible", "exact", "named"),
    [(1.0, False, {"kink", "wave"}), (2.5, False, {"kink"}), (2.5, True, {"kink", "wave"})],
)
def test_small_second_of_what_is_no_noise_closes_much_of_the_gap(
    plausible: float, exact: bool, named: set[str]
) -> None:
    """By hand: a ripple of 0.5 closes 250, less than a fifth of 1500 + 250; but a kink that is
    exact leaves nothing.
    """
    model = rippled(3.0, 0.5 * np.sin(20.0 * TIME), plausible)
    model.candidates["kink"] = replace(model.candidates["kink"], exact_form=exact)
    assert set(explained(model).final.effects) == named


class Pulse(Line):
    """A pulse that comes somewhere; where it does not meet the measured one the cost is flat."""

    parameters = (linear("a", 0.0, std=0.5),)

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            return (self.measured[run] - pulse(v["a"]))[None, :]

        return residual


def pulse(when: float) -> Array:
    """A pulse, 2 % of the time wide."""
    return 50.0 * np.exp(-(((TIME - when) / 0.02) ** 2))


def test_a_fit_in_another_valley_gets_out_by_trying_the_values_of_each_unknown() -> None:
    model = Pulse([pulse(0.19) + np.random.default_rng(1).standard_normal(len(TIME))])
    stuck = fit(model, (), [0], {"a": -0.3}, [{}])
    assert stuck.mean_square > 10.0
    found = sifted(model, (), [0], stuck)
    assert found.values["a"] == pytest.approx(0.19, abs=1e-3)
    assert found.mean_square == pytest.approx(1.0, abs=0.1)


class Washboard(Line):
    """A long valley, far steeper across than along, whose bottom is a washboard."""

    parameters = (linear("a", 0.0, std=2.0), linear("b", 0.0, std=2.0))

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            across = 30.0 * (v["b"] - v["a"])
            along = 4.0 * (v["a"] - 2.5) + np.sin(10.0 * v["a"])
            return (self.measured[run] + across * TIME + along)[None, :]

        return residual


def test_fit_that_stops_on_the_way_down_a_valley_is_followed_further() -> None:
    """By hand: along is 0 near a = 2.5 only, where sin(25) = -0.13 moves it to 2.51."""
    model = Washboard([noisy(np.zeros_like(TIME))])
    stopped = fit(model, (), [0], {"a": -1.0, "b": -1.0}, [{}])
    assert stopped.values["a"] < 1.5
    restarts = Restarts(runner=runner(model))
    assert restarts.followed(stopped).values["a"] == pytest.approx(2.51, abs=0.02)


class Gravel(Line):
    """A valley whose bottom is so rough that slopes at a point lead nowhere."""

    parameters = (linear("a", 0.0, std=10.0),)

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            away = v["a"] - 2.0
            return (self.measured[run] + 0.3 * away + 0.05 * np.sin(300.0 * away))[None, :]

        return residual


def test_wide_slopes_look_over_the_hollows_of_a_rough_cost() -> None:
    """By hand: 0.3 a + 0.05 sin(300 a) falls and rises 48 times a unit, and a difference of 30 in
    the norm of 2000 samples, 0.67 a sample, is two units of a: it sees 0.3 a alone.
    """
    model = Gravel([noisy(np.zeros_like(TIME))])
    stuck = fit(model, (), [0], {"a": -1.0}, [{}])
    assert stuck.values["a"] < 1.0
    found = smoothed(model, (), [0], stuck)
    assert found.values["a"] == pytest.approx(2.0, abs=0.25)


def test_start_from_some_way_off_stays_within_the_bounds() -> None:
    """Both may be told to go 20 off 0 and 2; what is asked of the machine there is recorded."""

    class Bounded(Hollow):
        parameters = (
            replace(linear("a", 0.0, std=10.0), lower=-1.0, upper=1.0),
            replace(linear("b", 2.0, prior=2.0, std=20.0), lower=1.0, upper=4.0),
        )
        asked: ClassVar[list[float]] = []

        def residual(
            self, run: int, effects: Sequence[str]
        ) -> Callable[[Mapping[str, float]], Array]:
            others = super().residual(run, effects)

            def residual(v: Mapping[str, float]) -> Array:
                self.asked.append(v["b"])
                return others(v)

            return residual

    model = Bounded([noisy(30.0 * TIME)], ["kink"])
    model.candidates["kink"] = replace(
        model.candidates["kink"], states=(linear("turn", 0.0, prior=0.0, std=1.0),)
    )
    start = fit_null(model, [0])
    far = replace(
        start,
        effects=("kink",),
        standard_errors={"a": 10.0, "b": 20.0, "kink_size": 1.0},
        values={**start.values, "kink_size": 0.0},
        states=({"turn": 0.0},),
    )
    for number in range(5):
        shaken(model, ("kink",), [0], far, number)
    assert min(model.asked) >= 1.0
    assert max(model.asked) <= 4.0
