"""What effects promise: the leaders of each score, and where their fits begin."""

from dataclasses import replace

from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.screening.promise import Promise, Start, leading, starts_of, to_try
from tests.plant_emulator.diagnosis.line import TIME, Line, noisy


def promise(effect: str, **gains: float) -> Promise:
    return Promise(effect=effect, gains=gains, starts={})


def test_leaders_of_each_score_gain_half_of_its_most() -> None:
    """a is fitted already; b leads the relations, and c gains half of the simulation's most."""
    found = [
        promise("a", relations=1.0, simulation=90.0),
        promise("b", relations=20.0, simulation=6.0),
        promise("c", relations=8.0, simulation=50.0),
        promise("d", relations=15.0, simulation=47.0),
        promise("e", relations=13.0, simulation=44.0),
    ]
    assert [p.effect for p in leading(found, 2, 5.0, ["a"])] == ["b", "d", "c"]
    assert [p.effect for p in leading(found, 2, 25.0, ["a"])] == ["c", "d"]
    assert [p.effect for p in leading(found, 1, 5.0, [])] == ["b", "a"]


def test_all_that_promise_something_are_tried_where_only_noise_is_left() -> None:
    """A faint effect that was promised 8 gained 42, and the leader's 37 were none."""
    found = [
        promise("a", simulation=37.0),
        promise("b", simulation=30.0),
        promise("c", simulation=17.0),
        promise("d", simulation=8.0),
        promise("e", simulation=0.5),
    ]
    noise = fit_null(Line([noisy(2.0 + 3.0 * TIME)]), (0,))
    assert {p.effect for p in to_try(found, noise, 5.0, [])} == {"a", "b", "c", "d"}
    gap = replace(noise, sum_of_squares=2.0 * noise.samples)
    assert {p.effect for p in to_try(found, gap, 5.0, [])} == {"a", "b"}
    beside = replace(noise, effects=("f",))
    assert {p.effect for p in to_try(found, beside, 5.0, ["a"])} == {"b"}
    far = replace(gap, effects=("f",))
    assert {p.effect for p in to_try(found, far, 5.0, ["a"])} == {"b"}


def test_effect_also_starts_at_the_parameters_of_the_set() -> None:
    base = replace(
        fit_null(Line([noisy(2.0 + 3.0 * TIME)]), (0,)),
        values={"a": 2.0, "b": 3.0},
        states=({"angle": 0.5},),
    )
    estimated = Start(
        values={"a": 7.0, "b": 8.0, "wave_size": 0.3}, states=({"angle": 0.9, "phase": 0.1},)
    )
    (told, kept), led = starts_of(
        Promise(effect="wave", gains={"relations": 1.0}, starts={"relations": estimated}), base
    )
    assert told == estimated
    assert led == (estimated,)
    assert kept.values == {"a": 2.0, "b": 3.0, "wave_size": 0.3}
    assert kept.states == ({"angle": 0.5, "phase": 0.1},)


def test_start_of_a_score_that_gains_far_less_is_led_only() -> None:
    """At the size of the relations, which see 12 of 370, a limit does not act."""
    base = fit_null(Line([noisy(2.0 + 3.0 * TIME)]), (0,))
    idle, acting = (Start(values={"wave_size": size}, states=({},)) for size in (0.0, 0.4))
    told = {"relations": idle, "simulation": acting}
    near, led = starts_of(
        Promise(effect="wave", gains={"relations": 12.0, "simulation": 370.0}, starts=told), base
    )
    assert [one.values["wave_size"] for one in near] == [0.4, 0.4]
    assert led == (acting, idle)
