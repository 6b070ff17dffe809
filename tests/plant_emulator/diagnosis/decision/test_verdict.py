"""The verdict on a machine so small that it can be checked by hand."""

from dataclasses import replace

import numpy as np

from plant_emulator.diagnosis.decision.verdict import Decision, decide, deviations
from plant_emulator.diagnosis.fitting.joint_fit import fit_null
from tests.plant_emulator.diagnosis.line import TIME, Line, explained, linear, noisy

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
