"""The lagging torque sensor against a first-order filter of its own."""

import numpy as np
import pytest

from plant_emulator.parameters import ParameterSet
from plant_emulator.simulate import values_of
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


def test_lag_is_in_the_sensor_only(nominal: ParameterSet) -> None:
    values = values_of(nominal, {"torque_sensor_lag": {"time_constant": 0.1}})
    plain, lagging = simulate(INPUTS, nominal.values()), simulate(INPUTS, values)
    for name in ("motor_speed", "drum_speed", "armature_current", "armature_voltage"):
        np.testing.assert_array_equal(plain[name], lagging[name])
