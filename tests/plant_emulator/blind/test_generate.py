"""The logs of a case, and the orthogonal norm of its hidden effects."""

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.blind import laws
from plant_emulator.blind.dirt import Dirt
from plant_emulator.blind.draw import draw
from plant_emulator.blind.generate import measure, simulate_truth
from plant_emulator.blind.orthogonal_norm import norms
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import COMPARED
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import SENSORS
from plant_emulator.simulation.simulate import simulate
from plant_emulator.solver.kernel import kernel, use_own_effects
from tests.plant_emulator.blind.conftest import case_with, hidden


def test_truth_has_the_gap_position_and_the_parameters_of_its_case(nominal: ParameterSet) -> None:
    """Small fixed steps and adaptive steps agree within half of the noise."""
    (log,) = simulate_truth(case_with(kind="none"), nominal)
    found = simulate(inputs_of(log), nominal.values(), gap_position=0.3)
    other = simulate(inputs_of(log), nominal.values(), gap_position=-0.3)
    errors = [np.abs(log[c] - found[c]).max() / SENSORS[c][0] for c in COMPARED]
    assert 0.0 < max(errors) < 0.5
    assert max(np.abs(log[c] - other[c]).max() / SENSORS[c][0] for c in COMPARED) > 5.0


def test_truth_that_does_not_converge_is_simulated_with_a_smaller_step(
    nominal: ParameterSet,
) -> None:
    """With steps of 0.2 ms one stage of program 3 does not converge in this case of presliding."""
    use_own_effects(*(laws.load(name) for name in laws.names()))
    case = draw(86028, 32, nominal, kernel().effects)
    assert [h.law for h in case.hidden] == ["elastoplastic_presliding"]
    found = simulate_truth(case, nominal)
    assert [log.source for log in found] == ["program1", "program2", "program3"]
    assert all(np.isfinite(log["shaft_torque"]).all() for log in found)


def test_measured_log_is_quantised_and_noisy(nominal: ParameterSet) -> None:
    case = case_with(kind="none")
    (true,) = simulate_truth(case, nominal)
    seen = measure(case, true, 0, nominal)
    deviation, step = SENSORS["armature_current"]
    counts = seen["armature_current"] / step
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    assert np.std(seen["armature_current"] - true["armature_current"]) == pytest.approx(
        deviation, rel=0.1
    )
    np.testing.assert_array_equal(seen["speed_reference"], true["speed_reference"])


def test_rows_off_their_stamps_show_the_bench_where_they_were_taken(nominal: ParameterSet) -> None:
    """On a ramp the motor moves as far as its reference; rows on their stamps are as before."""
    case = replace(case_with(kind="none"), dirt=Dirt(kind="jitter", size=1e-9))
    (true,) = simulate_truth(case, nominal)
    punctual = measure(case, true, 0, nominal)
    plain = measure(replace(case, dirt=None), true, 0, nominal)
    for name, (_, step) in SENSORS.items():
        if name in true:
            assert np.abs(punctual[name] - plain[name]).max() <= 1.001 * step
    off = measure(replace(case, dirt=Dirt(kind="jitter", size=2e-3)), true, 0, nominal)
    late = off["speed_reference"] - true["speed_reference"]
    ramp = np.gradient(true["speed_reference"], true.time) > 75.0
    moved = off["motor_speed"] - plain["motor_speed"]
    assert np.polyfit(late[ramp], moved[ramp], 1)[0] == pytest.approx(1.0, abs=0.05)


def test_log_has_the_columns_of_the_bench_and_no_voltage(nominal: ParameterSet) -> None:
    (log,) = simulate_truth(case_with(kind="none"), nominal)
    assert set(log.signals) == {"speed_reference", *COMPARED, "shell_temperature"}


@pytest.mark.parametrize(
    ("dirt", "added", "samples"),
    [
        (None, 0.0, 1851),
        (Dirt(kind="coarse", size=3.0), 3.0 * 0.25 / np.sqrt(12), 1851),
        (Dirt(kind="held", size=4.0), 0.0, 463),
    ],
)
def test_offset_of_a_sensor_has_the_norm_of_its_samples(
    dirt: Dirt | None, added: float, samples: int, nominal: ParameterSet
) -> None:
    """No parameter moves the torque alone, so nearly offset / noise x sqrt(samples) is left."""
    case = case_with(hidden("torque_sensor_offset", "torque_sensor", offset=0.5))
    case = replace(case, dirt=dirt)
    found = norms(case, simulate_truth(case, nominal), nominal)
    level = np.sqrt(0.25**2 + (100 / 4096) ** 2 / 12 + added**2)
    whole = 0.5 / level * np.sqrt(samples)
    assert 0.5 * whole < found["torque_sensor_offset"] < whole


@pytest.mark.parametrize(("asymmetry", "left"), [(0.02, 7.0), (-0.3, 15.0)])
def test_effect_confounded_with_parameter_deviations_is_not_detectable(
    asymmetry: float, left: float, nominal: ParameterSet
) -> None:
    """A bench that only runs forwards cannot tell an asymmetry from another Coulomb friction.

    The tangents alone would leave a norm of 159 of the large asymmetry.
    """
    case = case_with(hidden("friction_asymmetry", "gear", asymmetry=asymmetry))
    assert norms(case, simulate_truth(case, nominal), nominal)["friction_asymmetry"] < left
