"""Which effects are fitted on top of a fit, and from where."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.fitting.approach import approach_null, fit_null
from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.screening.screening import promises
from plant_emulator.diagnosis.search.moves import Moves
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import SHAPES, TIME, Line, noisy, runner

NULL = {"a": 0.0, "b": 0.0}


def confirmed(sets: Moves) -> list[tuple[str, ...]]:
    """The sets that were fitted freely."""
    return [step.effects for step in sets.trace if step.action == "confirmed"]


@pytest.mark.parametrize(("wave", "fitted"), [(1.0, [("kink",)]), (1.6, [("kink",), ("wave",)])])
def test_effects_that_gain_half_of_the_most_along_the_measured_outputs_are_fitted(
    wave: float, fitted: list[tuple[str, ...]]
) -> None:
    """By hand: 5 |t| gains 2000 5^2 / 24 = 2083, a wave of 1 2000 / 4 = 500, one of 1.6 1280.

    The regressions promise hardly more of the kink, so that the led fits choose.
    """
    y = noisy(2.0 + 3.0 * TIME + 5.0 * abs(TIME) + wave * np.sin(20.0 * TIME))
    model = Line([y], ("cube", "wave", "kink"))
    null = fit_null(model, (0,))
    alike = [
        replace(
            p,
            gains={"relations": 61.0 if p.effect == "kink" else 60.0},
            starts={"relations": p.starts["simulation"]},
        )
        for p in promises(runner(model), null, None)
    ]
    sets = Moves(runner=runner(model), null=null)
    sets.fit_on_top(null, alike, 5.0)
    assert confirmed(sets) == fitted
    led = {step.effects: step.gain for step in sets.trace if step.action == "led"}
    assert led["kink",] == pytest.approx(2083.0, rel=0.1)
    assert led["wave",] == pytest.approx(500.0 * wave**2, rel=0.1)


@pytest.mark.parametrize(
    ("promised", "least", "fitted"),
    [(60.0, 5.0, ["kink"]), (90.0, 5.0, ["kink", "wave"]), (90.0, 100.0, ["kink"])],
)
def test_effect_that_a_regression_promises_most_of_is_fitted_whatever_it_gains_when_led(
    promised: float, least: float, fitted: list[str]
) -> None:
    """By hand: 5 |t| gains 2083, and a wave of 0.5 120; t^3 leaves much. The kink promises 80."""
    y = 2.0 + 3.0 * TIME + 5.0 * abs(TIME) + 10.0 * TIME**3 + 0.5 * np.sin(20.0 * TIME)
    model = Line([noisy(y)], ("kink", "wave"))
    null = fit_null(model, (0,))
    gains = {"kink": 80.0, "wave": promised}
    supposed = [
        replace(
            p, gains={"relations": gains[p.effect]}, starts={"relations": p.starts["simulation"]}
        )
        for p in promises(runner(model), null, None)
    ]
    sets = Moves(runner=runner(model), null=null)
    sets.fit_on_top(null, supposed, least)
    assert [name for (name,) in confirmed(sets)] == fitted


@pytest.mark.parametrize(("cube", "fitted"), [(0.0, ["bowl"]), (10.0, ["bowl", "tub"])])
def test_rivals_of_an_effect_that_leaves_little_are_those_that_leave_little_too(
    cube: float, fitted: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """By hand: of |t| beside a constant t^2 follows 15/16 of the variance, and t^4 3/4.

    A cube, which is odd, leaves much beside all of them.
    """
    for name, power in (("bowl", 2), ("tub", 4)):
        monkeypatch.setitem(SHAPES, name, lambda x, power=power: x**power)
    y = 2.0 + 3.0 * TIME + 5.0 * abs(TIME) + cube * TIME**3
    model = Line([noisy(y)], ("kink", "bowl", "tub"))
    null = fit_null(model, (0,))
    sets = Moves(runner=runner(model), null=null)
    sets.fit_on_top(null, promises(runner(model), null, null), 5.0)
    (first,), *rivals = confirmed(sets)
    assert first == "kink"
    assert sorted(name for (name,) in rivals) == fitted


def test_all_effects_are_fitted_on_top_of_a_fit_that_leaves_noise() -> None:
    model = Line([noisy(2.0 + 3.0 * TIME + 0.3 * abs(TIME))], ("wave", "kink"))
    null = fit_null(model, (0,))
    assert null.mean_square <= NOISE_MEAN_SQUARE
    sets = Moves(runner=runner(model), null=null)
    sets.fit_on_top(null, promises(runner(model), null, None), 5.0)
    assert set(confirmed(sets)) == {("wave",), ("kink",)}


@pytest.mark.parametrize(("later", "kept"), [(4.0, ("kink", "wave")), (0.8, ("wave",))])
def test_refuted_set_is_fitted_without_each_of_its_effects(
    later: float, kept: tuple[str, ...]
) -> None:
    """The wave was never fitted alone. Beside a kink the runs must agree on it, alone not."""
    wave = np.sin(20.0 * TIME)
    model = Line([noisy(k * wave + 2.0 * abs(TIME)) for k in (4.0, later)], ("kink", "wave"))
    null = fit_null(model, (0, 1))
    both = fit(model, ("kink", "wave"), (0, 1), {"a": 0.0, "b": 0.0}, [{}, {}])
    sets = Moves(runner=runner(model), null=null)
    sets.sets = {frozenset(): null, frozenset(both.effects): both}
    assert sets.settled().effects == kept
    reduced = [step.effects for step in sets.trace if step.action == "reduced"]
    assert reduced == ([] if len(kept) > 1 else [("wave",), ("kink",)])


class Folded(Line):
    """A line whose offset has either sign: y = |a| + b x. Its own start is a = 1."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        plain = super().residual(run, effects)
        return lambda v: plain({**v, "a": abs(v["a"])})

    def start_values(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        """See `Model`."""
        return {"a": 1.0, "b": 0.0}, [{} for _ in runs]


@pytest.mark.parametrize("known", [True, False])
def test_fit_without_effects_is_led_from_the_best_led_fit_that_is_known(known: bool) -> None:
    """The free fit has bent a to -2. Its own start leads to 2."""
    model = Folded([noisy(2.0 + 3.0 * TIME + 5.0 * np.cos(23.0 * TIME))])
    bent = fit(model, (), (0,), {"a": -2.0, "b": 3.0}, [{}])
    _, led = approach_null(model, (0,))
    assert led is not None
    sets = Moves(runner=runner(model), null=bent, led_null=led if known else None)
    assert sets.led(bent).values["a"] == pytest.approx(2.0 if known else -2.0, abs=0.3)


class Caught(Line):
    """A free simulation in which an offset of 5 hides four fifths of the effects.

    Along the measured outputs nothing is hidden.
    """

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        plain = super().residual(run, effects)
        return lambda v: plain({**v, **{f"{e}_size": 0.2 * v[f"{e}_size"] for e in effects}})

    def observer(self, interval: float) -> Line:
        """See `Model`."""
        return Line(self.measured, list(self.candidates))


@pytest.mark.parametrize(("other", "most"), [(1.0, False), (5.0, False), (7.0, True)])
def test_first_effect_leaves_little_where_that_is_so_along_the_measured_outputs(
    other: float, most: bool
) -> None:
    """The fit stays at its start, a wave of 4; freely it shows a fifth of it. By hand: the wave has
    the mean square 8, and the others 0.5, 12.5 and 24.5. It explains 94, 39 or 25 % of both.
    """
    model = Caught([noisy(4.0 * np.sin(20.0 * TIME) + other * np.cos(37.0 * TIME))])
    null = fit_null(model, (0,))
    stuck = replace(
        null,
        effects=("wave",),
        values={**null.values, "wave_size": 4.0},
        cost=0.95 * null.cost,
        sum_of_squares=0.95 * null.sum_of_squares,
    )
    assert Moves(runner=runner(model), null=null).leaves_most(stuck, null) == most


def test_further_effect_whose_states_alone_follow_the_runs_is_refuted() -> None:
    null = fit_null(Line([noisy(TIME)]), (0,))
    sets = Moves(runner=runner(Line([noisy(TIME)])), null=null)
    for names, uncertain in ((("kink",), ("kink",)), (("kink", "wave"), ("wave",))):
        sets.sets[frozenset(names)] = replace(null, effects=names, insignificant=uncertain)
    assert not sets.refuted(frozenset({"kink"}))
    assert sets.refuted(frozenset({"kink", "wave"}))


def test_further_effect_must_gain_more_than_the_error_of_the_first_ones_law() -> None:
    """By hand: 3e-5 of a gain of 1e8 are 3000; of a small one they are less than 40, which count in
    the mean square that the set leaves.
    """
    null = fit_null(Line([noisy(2.0 + 3.0 * TIME)]), (0,))
    sets = Moves(runner=runner(Line([noisy(TIME)])), null=null)
    both = replace(null, effects=("kink", "wave"))
    large, small = (replace(both, cost=null.cost - 2.0 * gain) for gain in (1e8, 1e3))
    assert sets.needed(large, 1) == pytest.approx(3000.0)
    assert sets.needed(small, 1) == pytest.approx(40.0, rel=1e-3)
    assert sets.needed(large, 0) == pytest.approx(15.0, rel=1e-3)
    far = replace(small, sum_of_squares=3.0 * null.samples)
    assert sets.needed(far, 1) == pytest.approx(120.0)
    exact = replace(sets.runner.model.candidates["kink"], exact_form=True)
    sets.runner.model.candidates["kink"] = exact
    assert sets.needed(large, 1) == pytest.approx(40.0, rel=1e-3)


def test_error_of_a_law_may_tell_two_effects_beside_it_apart_the_wrong_way() -> None:
    """By hand: 3e-5 of a fall of the cost of 2e8 are 6000."""
    null = fit_null(Line([noisy(2.0 + 3.0 * TIME)]), (0,))
    sets = Moves(runner=runner(Line([noisy(TIME)])), null=null)
    large = replace(null, effects=("kink", "wave"), cost=null.cost - 2e8)
    assert sets.margin(large, "wave") == pytest.approx(6000.0)
    assert sets.margin(replace(large, effects=("wave",)), "wave") == 10.0
    assert sets.margin(replace(large, cost=null.cost - 2e3), "wave") == 10.0
    exact = replace(sets.runner.model.candidates["kink"], exact_form=True)
    sets.runner.model.candidates["kink"] = exact
    assert sets.margin(large, "wave") == 10.0
    assert sets.margin(large, "kink") == pytest.approx(6000.0)


def test_set_that_comes_near_the_data_is_screened_anew() -> None:
    """By hand: a cosine of 2 leaves squares of 2 beside the noise of 1, far from the data."""
    y = 2.0 + 3.0 * TIME + 4.0 * np.sin(20.0 * TIME)
    far, near = (
        fit(Line([noisy(y + left * np.cos(37.0 * TIME))]), ("wave",), (0,), NULL, [{}])
        for left in (2.0, 0.0)
    )
    sets = Moves(runner=runner(Line([noisy(y)])), null=near)
    key = frozenset({"wave"})
    for found, kept in ((far, True), (replace(far, cost=far.cost - 1.0), True), (near, False)):
        sets.promises[key] = []
        sets.expanded.add(key)
        sets.keep(found)
        assert [key in known for known in (sets.promises, sets.expanded)] == [kept] * 2


def test_set_that_finds_a_better_fit_is_led_from_there() -> None:
    model = Folded([noisy(2.0 + 3.0 * TIME + 5.0 * np.cos(37.0 * TIME))], ["wave"])
    values = {"a": -2.0, "b": 3.0, "wave_size": 0.0}
    poor = fit(model, ("wave",), (0,), values, [{}])
    sets = Moves(runner=runner(model), null=poor)
    sets.keep(poor)
    assert sets.led(poor).values["a"] < 0.0
    sets.keep(replace(poor, values={**poor.values, "a": 2.0}, cost=poor.cost - 1.0))
    assert sets.led(sets.sets[frozenset(["wave"])]).values["a"] > 0.0


def test_fit_without_effects_that_was_fitted_anew_is_led_from_there() -> None:
    """The model's own start leads to the other sign."""
    model = Folded([noisy(2.0 + 3.0 * TIME + 5.0 * np.cos(37.0 * TIME))])
    anew = fit(model, (), (0,), {"a": -2.0, "b": 3.0}, [{}])
    sets = Moves(runner=runner(model), null=anew)
    sets.take_null(anew)
    assert sets.led(anew).values["a"] == pytest.approx(-2.0, abs=0.3)
