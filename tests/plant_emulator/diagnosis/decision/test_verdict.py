"""The verdict on a machine so small that it can be checked by hand."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.decision.verdict import (
    Decision,
    decide,
    deviations,
    without_uncertain,
)
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.explanation import Explanation
from plant_emulator.estimation.unknowns import Unknown
from tests.plant_emulator.diagnosis.line import TIME, Line, explained, linear, noisy
from tests.plant_emulator.diagnosis.screening.warm import START, Warm

LINE = 2.0 + 3.0 * TIME
SAMPLE = np.arange(len(TIME))


def verdict(model: Line) -> Decision:
    return decide(model, explained(model))


def test_ripple_that_its_past_predicts_is_a_gap_without_a_name() -> None:
    ripple = 3.0 * np.sin(2.0 * np.pi * SAMPLE / 50.0)
    found = verdict(Line([noisy(LINE + ripple)], ["kink"]))
    assert found.kind == "unknown"


def test_ripple_as_small_as_the_noise_is_coloured_noise() -> None:
    """Its variance is a fifth of the noise's: no sample tells it from hum of an amplifier."""
    ripple = np.sqrt(0.4) * np.sin(2.0 * np.pi * SAMPLE / 5.0)
    both = np.random.default_rng(3).standard_normal(len(TIME)) + ripple
    assert verdict(Line([LINE + both / np.sqrt(1.2)])).kind == "parameter"


def test_same_line_in_white_noise_is_only_other_parameters() -> None:
    assert verdict(Line([noisy(LINE)])).kind == "parameter"


def test_effect_that_explains_much_more_than_is_left_is_named() -> None:
    ripple = np.sqrt(0.05) * np.sin(2.0 * np.pi * SAMPLE / 5.0)
    model = Line([noisy(LINE + 5.0 * np.abs(TIME) + ripple)], ["kink"])
    assert verdict(model).kind == "effect"


def test_shift_that_chance_may_explain_does_not_come_first() -> None:
    """Prior deviations of 10 and 0.1, errors of 1 and 0.1: b moves 3.5 errors and 3.5 deviations,
    which surprises more, but a moves 5 errors.
    """
    model = Line([noisy(LINE)])
    model.parameters = (linear("a", 0.0, prior=0.0, std=10.0), linear("b", 0.0, prior=0.0, std=0.1))
    values, errors = {"a": 5.0, "b": 0.35}, {"a": 1.0, "b": 0.1}
    point = replace(fit_null(model, [0]), values=values, standard_errors=errors)
    assert [(s.name, s.significant) for s in deviations(model, point)] == [
        ("a", True),
        ("b", False),
    ]


def with_sizes(
    model: Line, sizes: Mapping[str, float], error: float, without: float = 30.0
) -> Explanation:
    """What the tests of a model found, if its final fit had these sizes.

    without : rise of the cost without each effect
    """
    found = explained(model)
    final = replace(
        found.null,
        effects=tuple(sizes),
        values=found.null.values | {f"{name}_size": size for name, size in sizes.items()},
        standard_errors=found.null.standard_errors | {f"{name}_size": error for name in sizes},
    )
    costs = dict.fromkeys(sizes, final.cost + without)
    return replace(found, final=final, reduced_costs=costs, log_odds=30.0)


@pytest.mark.parametrize(
    ("error", "of_law", "named"),
    [
        (0.01, 0.0, ("cube", "wave")),
        # By hand: a law that is off by half of a plausible size of 1 makes an error of 0.5.
        (0.01, 0.5, ("wave",)),
        (0.5, 0.0, ("wave",)),
    ],
)
def test_effect_with_a_size_within_its_error_is_not_named(
    error: float, of_law: float, named: tuple[str, ...]
) -> None:
    model = Line([noisy(LINE)], ["cube", "wave"])
    found = with_sizes(model, {"cube": 0.4, "wave": -0.6}, error)
    decision = Decision(kind="effect", effects=found.named, deviations=(), reason="")
    errors = {"cube_size": of_law, "wave_size": of_law}
    after, told = without_uncertain(model, found, decision, errors)
    assert told.effects == after.named == named
    assert after.final == found.final


def test_effect_of_any_size_that_noise_cannot_do_without_is_named() -> None:
    """By hand: 200 of 2000 samples' squares are more than the noise's uncertainty of 5 %."""
    model = Line([noisy(LINE)], ["cube", "wave"])
    found = with_sizes(model, {"cube": 0.4, "wave": -0.6}, 0.5, without=200.0)
    decision = Decision(kind="effect", effects=found.named, deviations=(), reason="")
    _, told = without_uncertain(model, found, decision, {})
    assert told.effects == ("cube", "wave")
    apart = Line([noisy(LINE + 2.0 * TIME**3)], ["cube"])
    alone = with_sizes(apart, {"cube": 0.4}, 0.5)
    assert alone.null.mean_square > 1.05
    decision = Decision(kind="effect", effects=("cube",), deviations=(), reason="")
    _, told = without_uncertain(apart, alone, decision, {})
    assert told.effects == ("cube",)


def test_of_two_effects_of_uncertain_sizes_the_one_that_closes_least_falls() -> None:
    """They may stand for each other, and neither would be left."""
    model = Line([noisy(LINE)], ["cube", "wave"])
    found = with_sizes(model, {"cube": 0.4, "wave": -0.4}, 0.5)
    costs = {"cube": found.final.cost + 20.0, "wave": found.final.cost + 10.0}
    found = replace(found, reduced_costs=costs)
    decision = Decision(kind="effect", effects=found.named, deviations=(), reason="")
    after, told = without_uncertain(model, found, decision, {})
    assert told.effects == after.named == ("cube",)


@pytest.mark.parametrize(("size", "error", "of_law"), [(0.01, 0.02, 0.0), (0.4, 0.01, 0.5)])
def test_effect_alone_with_a_size_within_its_error_is_no_cause(
    size: float, error: float, of_law: float
) -> None:
    model = Line([noisy(LINE)], ["cube"])
    found = with_sizes(model, {"cube": size}, error)
    decision = Decision(kind="effect", effects=("cube",), deviations=(), reason="")
    after, told = without_uncertain(model, found, decision, {"cube_size": of_law})
    assert (told.kind, told.effects) == ("parameter", ())
    assert after.final == found.null
    # Its rival is better by as much as it was better than the next one.
    assert after.log_odds == -30.0


@pytest.mark.parametrize(
    ("off", "kind"), [((13.0, -13.0), "unknown"), ((13.0, 3.0), "effect"), ((3.0, 1.0), "effect")]
)
def test_effect_with_an_improbable_state_in_every_run_is_not_named(
    off: tuple[float, float], kind: str
) -> None:
    """The prior of the state has a deviation of 4, so that 12 are three of them."""
    model = Warm()
    found = explained(model)
    states = tuple({"warm_state": START + own} for own in off)
    decision = decide(model, replace(found, final=replace(found.final, states=states)))
    assert decision.kind == kind
    assert ("warm_state" in decision.reason) == (kind == "unknown")


@pytest.mark.parametrize(
    ("a", "error", "kind"),
    [
        (47.0, 1.0, "effect"),
        (-47.0, 1.0, "effect"),
        (48.0, 1.0, "unknown"),
        (-50.0, 1.0, "unknown"),
        (50.0, 20.0, "effect"),
    ],
)
def test_effect_that_needs_a_parameter_at_its_bound_is_not_named(
    a: float, error: float, kind: str
) -> None:
    """The bounds are 50 from the prior; 47.5 is where they begin. An error of 20 tells nothing."""
    found = explained(Line([noisy(LINE + 5.0 * np.abs(TIME))], ["kink"]))
    final = replace(
        found.final,
        values={**found.final.values, "a": a},
        standard_errors={**found.final.standard_errors, "a": error},
    )
    decision = decide(Line([LINE], ["kink"]), replace(found, final=final))
    assert decision.kind == kind
    assert (" a, at its bound" in decision.reason) == (kind == "unknown")


def test_parameter_at_its_bound_is_judged_by_what_the_fit_leaves_without_effects() -> None:
    found = explained(Line([noisy(LINE)], ["kink"]))
    final = replace(found.final, values={**found.final.values, "a": 50.0})
    assert final.effects == ()
    assert decide(Line([LINE], ["kink"]), replace(found, final=final)).kind == "parameter"


@pytest.mark.parametrize(("a", "kind"), [(0.23, "effect"), (0.21, "unknown"), (4.5, "effect")])
def test_bound_of_a_logarithmic_parameter_is_one_of_factors(a: float, kind: str) -> None:
    """By hand: 0.95 of a factor of 5 is 5^0.95 = 4.61, and one over that 0.217."""
    found = explained(Line([noisy(LINE + 5.0 * np.abs(TIME))], ["kink"]))
    final = replace(
        found.final,
        values={**found.final.values, "a": a},
        standard_errors={**found.final.standard_errors, "a": 0.01},
    )
    model = Line([LINE], ["kink"])
    model.parameters = (
        Unknown(name="a", start=1.0, lower=0.2, upper=5.0, prior=1.0, std=0.2),
        linear("b", 0.0, std=10.0),
    )
    assert decide(model, replace(found, final=final)).kind == kind
