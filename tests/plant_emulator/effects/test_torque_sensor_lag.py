"""The lagging torque sensor against filters of its own."""

import numpy as np
import pytest
from scipy.signal import lsim

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.simulation.simulate import values_of
from tests.plant_emulator.runs import linear, simulate

INPUTS = linear((0.2, 0.0), (1.2, 100.0), (2.0, 100.0), (3.0, 0.0), duration=4.0, period=0.001)


@pytest.mark.parametrize("tau", [0.02, 0.1, 0.5])
def test_shown_torque_is_the_first_order_filtered_shaft_torque(
    nominal: ParameterSet, tau: float
) -> None:
    """tau dT_s/dt = T - T_s, exactly integrated for a T that is linear over each millisecond."""
    true = simulate(INPUTS, nominal.values())["shaft_torque"]
    values = values_of(nominal, {"torque_sensor_lag": {"time_constant": tau}})
    shown = simulate(INPUTS, values)["shaft_torque"]
    h, decay = 1e-3, np.exp(-1e-3 / tau)
    expected = np.zeros_like(true)
    for k in range(1, len(true)):
        slope = (true[k] - true[k - 1]) / h
        ahead = true[k] - tau * slope
        expected[k] = ahead + (expected[k - 1] - true[k - 1] + tau * slope) * decay
    assert np.abs(shown - expected).max() < 2e-3 * np.ptp(true)


@pytest.mark.parametrize(
    ("q", "poles"),
    [
        (0.25, ([1.0], [0.0025, 0.1, 1.0])),  # two lags of 0.05 s
        (0.16, ([1.0], [0.0016, 0.1, 1.0])),  # lags of 0.08 s and 0.02 s
        (0.5, ([1.0], [0.005, 0.1, 1.0])),  # swings: zeta = 0.71
        (-1.0, ([0.1, 1.0], [0.2, 1.0])),  # half of the torque at once, half through 0.2 s
    ],
)
def test_shown_torque_is_filtered_by_the_transfer_function(
    nominal: ParameterSet, q: float, poles: tuple[list[float], list[float]]
) -> None:
    """Each of a mean delay of 0.1 s; integrated by scipy, the torque linear over a millisecond."""
    true = simulate(INPUTS, nominal.values())["shaft_torque"]
    lag = {"torque_sensor_lag": {"time_constant": 0.1, "second_order": q}}
    shown = simulate(INPUTS, values_of(nominal, lag))["shaft_torque"]
    expected = lsim(poles, true, 1e-3 * np.arange(len(true)))[1]
    assert np.abs(shown - expected).max() < 3e-4 * np.ptp(true)


def test_shape_passes_smoothly_through_first_order(nominal: ParameterSet) -> None:
    """The slopes in q on both sides of 0 agree: a fit may step across."""

    def shown(q: float) -> np.ndarray:
        lag = {"torque_sensor_lag": {"time_constant": 0.1, "second_order": q}}
        return np.asarray(simulate(INPUTS, values_of(nominal, lag))["shaft_torque"])

    above, below = shown(1e-3) - shown(0.0), shown(0.0) - shown(-1e-3)
    assert np.linalg.norm(above - below) < 0.05 * np.linalg.norm(above)


def test_lag_is_in_the_sensor_only(nominal: ParameterSet) -> None:
    values = values_of(nominal, {"torque_sensor_lag": {"time_constant": 0.1}})
    plain, lagging = simulate(INPUTS, nominal.values()), simulate(INPUTS, values)
    for name in ("motor_speed", "drum_speed", "armature_current", "armature_voltage"):
        np.testing.assert_array_equal(plain[name], lagging[name])
