"""The grammar of laws: values, text, and the lag that it is made of."""

import numpy as np
import pytest

from plant_emulator.diagnosis.missing_law.grammar import Factor, Term, terms
from plant_emulator.diagnosis.missing_law.states import LawState, lag_state

TIME = np.arange(0.005, 3.0, 0.01)


def state(kind: str, values: list[float], lags: tuple[float, ...] = ()) -> LawState:
    return LawState(
        name="gear speed",
        symbol="w",
        unit="rad/s",
        code="abs(s.gear_speed)",
        kind=kind,  # type: ignore[arg-type]  # a literal of the test
        values=[np.array(values)],
        time=[np.arange(len(values)) * 0.01],
        lags=lags,
    )


def test_lag_of_a_step_reaches_63_percent_after_its_time_constant() -> None:
    found = lag_state(TIME, np.ones_like(TIME), 0.5, 0.0)
    assert found[49] == pytest.approx(1.0 - np.exp(-1.0), abs=1e-9)


def test_lag_of_a_ramp_follows_its_time_constant_behind() -> None:
    found = lag_state(TIME, 2.0 * TIME, 0.1, 0.0)
    assert 2.0 * TIME[-1] - found[-1] == pytest.approx(2.0 * 0.1, rel=0.06)


@pytest.mark.parametrize(
    ("function", "scale", "expected"),
    [
        ("linear", 0.0, [-4.0, 0.0, 9.0]),
        ("size", 0.0, [4.0, 0.0, 9.0]),
        ("square", 0.0, [-16.0, 0.0, 81.0]),
        ("root", 0.0, [-2.0, 0.0, 3.0]),
        ("sign", 0.0, [-1.0, 0.0, 1.0]),
        ("bell", 4.0, [np.exp(-1.0), 1.0, np.exp(-81.0 / 16.0)]),
    ],
)
def test_functions_of_a_signed_state(function: str, scale: float, expected: list[float]) -> None:
    factor = Factor(function, state("signed", [-4.0, 0.0, 9.0]), scale)  # type: ignore[arg-type]
    np.testing.assert_allclose(factor.values(0)[:, 0], expected)


def test_play_of_a_sensor_starts_at_rest_and_loses_half_its_width_at_each_reversal() -> None:
    factor = Factor("play", state("signed", [1.0, 5.0, 4.0, 1.0, -3.0], lags=(0.1,)), 2.0)
    shown = factor.values(0)[:, 0] + factor.state.values[0]
    np.testing.assert_allclose(shown, [0.0, 3.0, 3.0, 3.0, -1.0])


def test_product_of_two_factors_is_their_product() -> None:
    one = Factor("linear", state("level", [1.0, 2.0, 3.0]))
    other = Factor("root", state("level", [4.0, 9.0, 16.0]))
    np.testing.assert_allclose(Term((one, other)).values(0, 3)[:, 0], [2.0, 6.0, 12.0])


def test_turn_has_a_cosine_and_a_sine_because_its_phase_is_unknown() -> None:
    turn = Term((Factor("turn", state("angle", [0.0, np.pi / 2.0, np.pi]), 1.0),))
    assert turn.own
    np.testing.assert_allclose(turn.values(0, 3), [[1, 0], [0, 1], [-1, 0]], atol=1e-12)


def test_terms_hold_a_constant_once_and_no_product_of_a_state_with_itself() -> None:
    speed, load = state("level", [1.0, 2.0]), state("signed", [-1.0, 5.0])
    found = terms([speed, load])
    assert sum(not term.factors for term in found) == 1
    assert all(len(set(term.states)) == len(term.factors) for term in found)


def test_formula_names_state_function_and_scale() -> None:
    speed = state("level", [0.0, 3.0], lags=(30.0,))
    assert Term((Factor("bell", speed, 0.4),)).text == "exp(-(w/0.4)^2)"
    assert Factor("lag", speed, 30.0).text == "lag(w, 30 s)"
    assert Factor("square", speed).text == "w^2"


def test_no_multiple_of_a_curved_state_is_a_law() -> None:
    """A force along the acceleration is an inertia."""
    found = [term.text for term in terms([state("curved", [-1.0, 0.0, 2.0])])]
    assert found == ["", "|w|", "w |w|"]


def test_direction_takes_a_narrow_bell_of_a_speed() -> None:
    """Friction that rises towards standstill, against the motion."""
    speed, direction = state("signed", [-10.0, 5.0]), state("direction", [-1.0, 1.0])
    found = {term.text for term in terms([speed, direction])}
    assert "exp(-(w/0.2)^2) w" in found  # both states have the letter w
