"""Runs that follow the steps of another one."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from plant_emulator.estimation import residuals
from plant_emulator.estimation.least_squares import estimate
from plant_emulator.estimation.residuals import SimulatedRun, run_residual
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import COMPARED, Log
from plant_emulator.simulation import simulate as simulation
from plant_emulator.simulation.programs import program
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import SENSORS, add_noise
from plant_emulator.simulation.simulate import (
    FIT_TOLERANCE,
    Settings,
    simulate,
    simulate_with_steps,
)
from plant_emulator.solver.kernel import Kernel, use_own_effects
from plant_emulator.solver.sdirk import GAMMA
from plant_emulator.solver.stepper import NO_STEPS
from tests.plant_emulator.runs import linear

# Contact, gap and rest.
RUN = inputs_of(linear((0.0, 0.0), (5.0, 380.0), (8.0, 380.0), (11.5, 0.0), duration=12.0))
INERTIA = Unknown(name="drum_inertia", start=312.69, lower=200.0, upper=500.0)
LOOSE = Settings(0.3, FIT_TOLERANCE, 0.03)


def channels(log: Log) -> np.ndarray:
    """The compared channels in the noise of their sensors, shape (channels, samples)."""
    return np.stack([log[name] / SENSORS[name][0] for name in COMPARED])


def along(follow: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
    return channels(simulate_with_steps(RUN, values, LOOSE._replace(follow=follow))[0])


def test_steps_of_a_run_lead_to_the_same_run(nominal: ParameterSet) -> None:
    """But for the last digits of iterations, which start from the steps that were refused."""
    log, steps = simulate_with_steps(RUN, nominal.values(), LOOSE)
    begins, lengths = steps.T
    np.testing.assert_allclose(begins[1:], begins[:-1] + lengths[:-1], rtol=0.0, atol=1e-9)
    assert begins[0] == 0.0
    assert begins[-1] + lengths[-1] == pytest.approx(12.0)
    again = along(steps, nominal.values())
    np.testing.assert_allclose(again, channels(log), rtol=0.0, atol=1e-7)


@pytest.mark.parametrize(
    "name", ["drum_inertia", "flux_constant_1", "backlash_half_gap", "dead_time"]
)
def test_slope_along_the_same_steps_is_that_of_a_converged_run(
    nominal: ParameterSet, name: str
) -> None:
    """Steps of its own would miss a tenth and more of the slope."""
    values = nominal.values()
    changed = {**values, name: 1.0001 * values[name]}
    fine = [channels(simulate(RUN, v, gap_position=0.3, tolerance=1e-8)) for v in (values, changed)]
    slope = fine[1] - fine[0]
    log, steps = simulate_with_steps(RUN, values, LOOSE)
    missed = along(steps, changed) - channels(log) - slope
    assert np.linalg.norm(missed) < 0.05 * np.linalg.norm(slope)


def test_steps_that_are_too_many_to_keep_are_not_followed(
    nominal: ParameterSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulation, "MOST_STEPS", 0)
    log, steps = simulate_with_steps(RUN, nominal.values(), LOOSE)
    assert steps.shape == (0, 2)
    np.testing.assert_array_equal(along(steps, nominal.values()), channels(log))


UNSOLVED_AT_A_TIME = """
def drum_torque(value, s, p):
    return value if abs(s.time - p.own_size) > 1e-5 else float('nan')
"""


def test_run_whose_followed_steps_cannot_be_solved_takes_its_own(
    nominal: ParameterSet, model_with: Callable[[str], Kernel]
) -> None:
    """The drum's torque is no number for 20 us, within which a stage of the other run lies."""
    effect = model_with(UNSOLVED_AT_A_TIME).effects["own"]
    use_own_effects(effect)
    values, elsewhere = nominal.values(), {"gap_position": 0.3, "own_size": -1.0}
    inputs = inputs_of(linear((0.0, 0.0), (0.5, 60.0), duration=0.8))
    run = SimulatedRun(inputs, values, FIT_TOLERANCE, 0.03)
    plain, near = channels(run(elsewhere)), run.near(elsewhere)
    begin, length = near.follow[len(near.follow) // 2]
    there = {**elsewhere, "own_size": begin + GAMMA * length}
    found = near(there)
    np.testing.assert_array_equal(channels(found), channels(run(there)))
    assert np.linalg.norm(channels(found) - plain) < 1.0
    assert not np.array_equal(channels(found), plain)


def test_neighbour_needs_no_simulation_where_its_values_were_the_last(
    nominal: ParameterSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulated = []

    def counted(*arguments: Any) -> tuple[Log, np.ndarray]:
        simulated.append(arguments)
        return simulate_with_steps(*arguments)

    monkeypatch.setattr(residuals, "simulate_with_steps", counted)
    run = SimulatedRun(RUN, nominal.values())
    first, last = {"gap_position": 0.3}, {"gap_position": 0.2}
    run(first)
    steps = run.near(first).follow
    assert len(steps) > 0
    assert len(simulated) == 1
    run(last)
    np.testing.assert_array_equal(run.near(first).follow, steps)
    assert len(simulated) == 3
    assert run.follow is NO_STEPS


def test_unknown_that_a_run_does_not_show_has_no_slope_and_no_finite_error(
    nominal: ParameterSet,
) -> None:
    """In rest no friction acts; the last digits of two runs differ all the same."""
    moving = replace(INERTIA, start=1.02 * INERTIA.start)
    shown = replace(INERTIA, name="voltage_limit", start=2000.0, lower=1000.0, upper=9000.0)
    log = add_noise(simulate(RUN, nominal.values(), gap_position=0.3), 1)
    residual = run_residual(recording(log), {**nominal.values(), "gap_position": 0.3})
    found = estimate([moving, shown], [residual])
    assert found.parameters()["voltage_limit"] == pytest.approx(2000.0, rel=1e-6)
    assert not found.jacobians[0][..., 1].any()
    assert found.standard_errors[1] == np.inf
    assert found.parameters()["drum_inertia"] == pytest.approx(INERTIA.start, rel=0.01)


def test_step_to_a_sample_may_be_a_twentieth_longer_than_the_longest(
    nominal: ParameterSet,
) -> None:
    """At rest all steps are the longest; by hand, 100 samples take one or two steps each."""
    rest = inputs_of(linear((0.0, 0.0), duration=1.0))
    for longest, steps in ((0.0096, 100), (0.0094, 200)):
        settings = Settings(0.0, FIT_TOLERANCE, longest)
        assert len(simulate_with_steps(rest, nominal.values(), settings)[1]) == steps


def test_integrator_that_slides_along_its_limit_has_a_slope(nominal: ParameterSet) -> None:
    """The drive lacks voltage, and the speed's integrator keeps the wanted current at its limit.

    Where it was held and let go in turn, the last digits decided which, and the quotients were
    34, 124 094, 47 and 1 153 rad/s.
    """
    run = inputs_of(program("program3").inputs())
    field = {"flux_constant_1": 401.0, "flux_constant_2": 5.2, "gear_viscous_friction": 315.0}
    values = {**nominal.values(), **field, "drum_inertia": 262.0}
    settings = Settings(0.0, FIT_TOLERANCE, None)
    log, steps = simulate_with_steps(run, values, settings)

    def quotient(change: float) -> float:
        friction = values["gear_coulomb_friction"] * (1.0 + change)
        near = {**values, "gear_coulomb_friction": friction}
        other, _ = simulate_with_steps(run, near, settings._replace(follow=steps))
        return float(np.max(np.abs(other["motor_speed"] - log["motor_speed"]))) / change

    quotients = [quotient(change) for change in (1e-8, 1e-7, 1e-6, 1e-5)]
    np.testing.assert_allclose(quotients, quotients[0], rtol=0.05)
