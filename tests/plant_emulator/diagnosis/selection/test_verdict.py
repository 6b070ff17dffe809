"""The verdict on a machine so small that it can be checked by hand."""

from dataclasses import replace

import numpy as np

from plant_emulator.diagnosis.fitting.joint_fit import fit_null
from plant_emulator.diagnosis.selection.verdict import Decision, decide, deviations
from tests.plant_emulator.diagnosis.line import TIME, Line, explained, linear, noisy

LINE = 2.0 + 3.0 * TIME
SAMPLE = np.arange(len(TIME))


def verdict(model: Line) -> Decision:
    return decide(model, explained(model))


def test_ripple_as_small_as_the_noise_is_a_gap_without_a_name() -> None:
    """Within the noise's square of 1.1, but correlated: 2000 * 10 (0.2 / 1.2)^2 = 560."""
    ripple = np.sqrt(0.4) * np.sin(2.0 * np.pi * SAMPLE / 5.0)
    both = np.random.default_rng(3).standard_normal(len(TIME)) + ripple
    found = verdict(Line([LINE + both / np.sqrt(1.2)]))
    assert found.kind == "unknown"
    assert "not as random" in found.reason


def test_same_line_in_white_noise_is_only_other_parameters() -> None:
    assert verdict(Line([noisy(LINE)])).kind == "parameter"


def test_effect_that_explains_less_than_is_left_beside_it_is_not_named() -> None:
    """The kink lowers the cost by some 40; the ripple beside it has a structure of 560."""
    ripple = np.sqrt(0.4) * np.sin(2.0 * np.pi * SAMPLE / 5.0)
    both = np.random.default_rng(3).standard_normal(len(TIME)) + ripple
    model = Line([LINE + both / np.sqrt(1.2) + 0.5 * np.abs(TIME)], ["kink"])
    assert explained(model).final.effects == ("kink",)
    assert verdict(model).kind == "unknown"


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
