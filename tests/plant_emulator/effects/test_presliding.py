"""Friction that builds up over a displacement, against Dahl's solutions by hand."""

from math import exp, log

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.stage import FIRST_MEMORY
from plant_emulator.signals.log import Log
from plant_emulator.simulation.running_bench import Bench
from plant_emulator.solver.effect_check import memory_names
from tests.plant_emulator.model.test_plant import energy
from tests.plant_emulator.runs import BACKLASH, GEAR, Piecewise, linear, simulate

F_GC, Z_S = 35.989, 0.01
SOFT = {"presliding_displacement": Z_S}
COMPARED = ("motor_speed", "drum_speed", "armature_current", "shaft_torque")
CORNERS = ((0.1, 0.0), (1.0, 150.0), (1.5, 150.0), (2.5, -120.0), (3.5, 0.0))


def viscous(omega: float) -> float:
    """Viscous friction of the table at a speed of the gear output [N m]."""
    return 345.38 * abs(omega) ** 0.4418


# --- pushed from rest ---------------------------------------------------------------------------


def pushed(nominal: ParameterSet, direction: float) -> list[tuple[float, float]]:
    """Displacement [rad] and Coulomb friction [N m] of a gear that turns slowly from rest.

    The drum rests in the middle of its gap, so what the shaft gives is the gear's friction, and
    the angle of the gap is the displacement; the gear's own inertia takes 0.01 N m.
    """
    bench, found = Piecewise({**nominal.values(), **SOFT}), []
    for k in range(1, 4000):
        torque = -62.6 * direction * bench.to(1e-3 * k, direction * 2e-3 * k)[-1, 3]
        displacement, omega = direction * bench.x[BACKLASH], bench.x[GEAR]
        found.append((displacement, torque - viscous(omega)))
        if displacement > 5.0 * Z_S:
            return found
    raise AssertionError("the gear did not move")


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_friction_builds_up_exponentially_with_the_displacement(
    nominal: ParameterSet, direction: float
) -> None:
    """f_gc (1 - exp(-theta / z_s)): the solution of Dahl's equation for a motion one way."""
    found = pushed(nominal, direction)
    for displacement, friction in found:
        expected = F_GC * (1.0 - exp(-displacement / Z_S))
        assert friction == pytest.approx(expected, abs=0.01 * F_GC)
    assert found[-1][1] > 0.98 * F_GC


def test_small_displacement_meets_a_spring(nominal: ParameterSet) -> None:
    """The spring has the stiffness f_gc / z_s, within the curvature up to a tenth of z_s."""
    pairs = [pair for pair in pushed(nominal, 1.0) if 0.02 * Z_S < pair[0] < 0.1 * Z_S]
    assert len(pairs) > 5
    for displacement, friction in pairs:
        assert friction / displacement == pytest.approx(F_GC / Z_S, rel=0.1)


# --- under a constant load ----------------------------------------------------------------------

# Without viscous friction, and with a short-circuited motor, that brakes but holds nothing.
UNDRIVEN = {"presliding_displacement": 1e-3, "gear_viscous_friction": 0.0, "voltage_limit": 1e-12}
# Torque of that motor at the gear output, (k Phi)^2 / R_a xi^2 [N m s/rad].
BRAKE = 1.8506**2 / 0.424 * 62.6**2


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_gear_under_a_load_below_its_level_yields_once_and_stays(
    nominal: ParameterSet, direction: float
) -> None:
    """20 N m from the drum: theta = -z_s ln(1 - 20 / f_gc), and no drift from there on."""
    bench = Piecewise({**nominal.values(), **UNDRIVEN}, gap_position=-direction)
    turned, load = 0.0, direction * 20.0 * 0.1715 / 0.645
    for end in (40.0, 80.0):
        motor = bench.to(end, 0.0, wheel_torque=load, pieces=4000)[:, 0]
        turned += float(np.sum(0.5 * (motor[1:] + motor[:-1]))) * 0.01 / 62.6
        assert abs(bench.x[GEAR]) < 1e-12
        assert direction * turned == pytest.approx(-1e-3 * log(1.0 - 20.0 / F_GC), rel=2e-3)


def test_gear_under_a_load_above_its_level_slides_on(nominal: ParameterSet) -> None:
    bench = Piecewise({**nominal.values(), **UNDRIVEN}, gap_position=-1.0)
    bench.to(120.0, 0.0, wheel_torque=1.1 * F_GC * 0.1715 / 0.645)
    assert bench.x[GEAR] == pytest.approx(0.1 * F_GC / BRAKE, rel=2e-3)


# --- sliding ------------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [5.0, 120.0, -120.0])
@pytest.mark.parametrize("asymmetry", [0.0, 0.2])
def test_steady_speed_needs_the_friction_of_the_table_in_its_direction(
    nominal: ParameterSet, speed: float, asymmetry: float
) -> None:
    values = {**nominal.values(), **SOFT, "friction_asymmetry_asymmetry": asymmetry}
    run = simulate(linear((0.5, 0.0), (4.5, speed), duration=60.0, period=0.1), values)
    torque = -62.6 * float(np.mean(run["shaft_torque"][-50:]))
    factor = np.sign(speed) + asymmetry
    assert torque == pytest.approx(factor * (F_GC + viscous(speed / 62.6)), rel=2e-4)


def run_of_size(nominal: ParameterSet, displacement: float) -> Log:
    values = {**nominal.values(), "presliding_displacement": displacement}
    return simulate(linear(*CORNERS, duration=5.0), values)


def test_smallest_displacement_that_yields_is_a_rigid_contact_to_the_sensors(
    nominal: ParameterSet,
) -> None:
    """So a fit meets no step where the contact becomes rigid."""
    rigid, yielding = run_of_size(nominal, 0.0), run_of_size(nominal, 5.1e-7)
    noise = {"motor_speed": 0.15, "drum_speed": 0.01, "armature_current": 0.25,
             "shaft_torque": 0.25}  # fmt: skip
    for name, sigma in noise.items():
        difference = (yielding[name] - rigid[name]) / sigma
        assert 0.0 < np.sqrt(np.mean(difference**2)) < 0.2, name


def test_mirrored_reference_gives_mirrored_run(nominal: ParameterSet) -> None:
    run = run_of_size(nominal, Z_S)
    mirror = linear(*((t, -w) for t, w in CORNERS), duration=5.0)
    other = simulate(mirror, {**nominal.values(), **SOFT})
    for name in COMPARED:
        np.testing.assert_array_equal(run[name], -other[name])


# --- energy and settling ------------------------------------------------------------------------


@settings(max_examples=30, deadline=None)
@given(
    speeds=st.tuples(*[st.floats(-2.0, 2.0)] * 2),
    gap=st.floats(-0.155, 0.155),
    bend=st.floats(-1.0, 1.0),
    z_s=st.sampled_from([1e-4, Z_S, 0.1]),
)
def test_free_bench_only_loses_energy(
    nominal: ParameterSet, speeds: tuple[float, float], gap: float, bend: float, z_s: float
) -> None:
    """Counted with that of the bent contacts, f_gc / z_s z^2 / 2."""
    values = {**nominal.values(), "presliding_displacement": z_s, "voltage_limit": 1e-12}
    bench = Piecewise(values)
    place = FIRST_MEMORY + memory_names(bench.model.effects).index("presliding_bend")
    bench.x[:8] = [0.0, 0.0, 0.0, 62.6 * speeds[0], 0.0, speeds[0], gap, speeds[1]]
    bench.x[place] = bend * z_s

    def total() -> float:
        return energy(bench.x) + 0.5 * F_GC / z_s * float(bench.x[place]) ** 2

    before = first = total()
    for k in range(1, 61):
        bench.to(0.01 * k, 0.0)
        now = total()
        assert now <= before + 1e-12 * (first + 1.0)
        before = now


@pytest.mark.parametrize("displacement", [5.1e-7, 1e-5, 1e-3, 0.1])
def test_bench_settles_through_reversals_and_rest(
    nominal: ParameterSet, displacement: float
) -> None:
    bench = Bench(nominal, {"presliding": {"displacement": displacement}})
    bench.advance([20.0 * np.sin(2e-3 * k) for k in range(4000)])
    bench.advance([0.0] * 4000)
    bench.advance([0.05 * np.sin(1e-3 * k) for k in range(4000)])
    assert bench.unsettled == 0
    assert np.isfinite(run_of_size(nominal, displacement)["shaft_torque"]).all()
