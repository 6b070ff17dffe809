"""Steps longer than a sample: the samples that they pass over."""

import numpy as np
import pytest

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import COMPARED, Log
from plant_emulator.simulation.fit_metrics import validate
from plant_emulator.simulation.programs import PROGRAMS, SpeedProgram
from tests.plant_emulator.runs import linear, simulate, with_truck

CHANNELS = (*COMPARED, "armature_voltage", "shell_temperature")


def inputs_of(name: str) -> Log:
    program = PROGRAMS[name]
    assert isinstance(program, SpeedProgram)
    time, reference = program.reference()
    return Log(time, {"speed_reference": reference}, name)


@pytest.mark.parametrize("name", ["program1", "program2", "program3"])
def test_samples_passed_over_lie_on_the_run_that_lands_on_them(
    nominal: ParameterSet, name: str
) -> None:
    landing = simulate(inputs_of(name), nominal.values(), tolerance=1e-8)
    passing = simulate(inputs_of(name), nominal.values(), tolerance=1e-6, largest_step=0.1)
    for channel in CHANNELS:
        error = np.sqrt(np.mean((landing[channel] - passing[channel]) ** 2))
        assert error <= 1e-4 * np.ptp(landing[channel]), channel


def test_error_of_long_steps_falls_with_their_tolerance(nominal: ParameterSet) -> None:
    inputs, values = inputs_of("program1"), nominal.values()
    converged = simulate(inputs, values, tolerance=1e-9)
    errors = [
        max(
            fit.nrmsd
            for fit in validate(
                converged, simulate(inputs, values, tolerance=tolerance, largest_step=0.1)
            ).values()
        )
        for tolerance in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[1] < 2e-4


@pytest.mark.parametrize(
    ("gap", "values"),
    [
        (
            -0.77,
            {
                "flux_constant_1": 404.3,
                "flux_constant_2": 4.032,
                "drum_shaft_damping": 130400.0,
                "gear_coulomb_friction": 31.9,
                "gear_viscous_friction": 329.7,
                "gear_friction_exponent": 0.437,
                "backlash_half_gap": 0.1203,
                "drum_inertia": 305.4,
                "dead_time": 0.05841,
            },
        ),
        (
            0.97,
            {
                "flux_constant_1": 400.3,
                "flux_constant_2": 4.032,
                "drum_shaft_damping": 143400.0,
                "gear_coulomb_friction": 36.49,
                "gear_viscous_friction": 390.9,
                "gear_friction_exponent": 0.4503,
                "backlash_half_gap": 0.1783,
                "drum_inertia": 313.7,
                "dead_time": 0.06065,
            },
        ),
    ],
)
def test_contact_after_a_flight_does_not_depend_on_the_step(
    nominal: ParameterSet, gap: float, values: dict[str, float]
) -> None:
    """A limit of the current ends just before the drum flies: 1 ms moves the contact after it."""
    inputs, whole = inputs_of("program3"), {**nominal.values(), **values}
    fine = simulate(inputs, whole, gap_position=gap, tolerance=1e-9, largest_step=2e-3)
    coarse = simulate(inputs, whole, gap_position=gap, tolerance=1e-6, largest_step=0.03)
    assert np.linalg.norm(coarse["shaft_torque"] - fine["shaft_torque"]) < 0.5


def test_no_sample_is_left_out_where_corners_lie_on_samples(nominal: ParameterSet) -> None:
    values = {**nominal.values(), "dead_time": 0.0}
    inputs = linear((0.1, 0.0), (0.5, 80.0), (0.73, 80.0), (0.9, 20.0), duration=1.2)
    landing = simulate(inputs, values)
    passing = simulate(inputs, values, largest_step=0.2)
    np.testing.assert_allclose(passing["motor_speed"], landing["motor_speed"], rtol=0, atol=0.01)


def test_no_step_spans_a_change_of_the_trucks_torque(nominal: ParameterSet) -> None:
    inputs = linear((0.1, 0.0), (1.0, 50.0), duration=3.0)
    torque = np.where(inputs.time > 1.505, 40.0, 20.0)
    landing = simulate(with_truck(inputs, torque), nominal.values())
    passing = simulate(with_truck(inputs, torque), nominal.values(), largest_step=0.5)
    np.testing.assert_array_equal(passing["wheel_torque"], landing["wheel_torque"])
    np.testing.assert_allclose(passing["drum_speed"], landing["drum_speed"], rtol=0, atol=1e-4)
