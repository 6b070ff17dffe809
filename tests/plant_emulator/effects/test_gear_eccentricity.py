"""Friction that swings with the angle of the gear output, against its law by hand."""

from math import cos, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import Array, Log
from plant_emulator.simulation.running_bench import Bench
from tests.plant_emulator.model.test_plant import energy
from tests.plant_emulator.runs import GEAR, Piecewise, linear, simulate

ECCENTRIC = {"gear_eccentricity_amplitude": 0.1, "gear_eccentricity_phase": 0.7}
OUTPUT = 5.0  # speed of the gear output [rad/s]
COMPARED = ("motor_speed", "drum_speed", "armature_current", "shaft_torque")


def table(omega: Array) -> Array:
    """Friction of the table at a speed of the gear output [N m]."""
    return 35.989 + 345.38 * np.abs(omega) ** 0.4418


def steady(nominal: ParameterSet, direction: float) -> tuple[Log, Array]:
    """A run that ends in steady speed, and which samples are steady."""
    inputs = linear((0.5, 0.0), (3.0, direction * OUTPUT * 62.6), duration=40.0)
    log = simulate(inputs, {**nominal.values(), **ECCENTRIC})
    return log, log.time > 20.0


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_friction_follows_the_angle_turned_since_the_start(
    nominal: ParameterSet, direction: float
) -> None:
    """(1 + 0.1 cos(theta + 0.7)) T_f, theta by the trapezoidal rule from the motor's speed.

    Compared while the drum floats in its gap, as it does nearly always.
    """
    log, late = steady(nominal, direction)
    floats = late & (np.abs(np.gradient(log["drum_speed"])) < 1e-9)
    assert np.mean(floats[late]) > 0.9
    omega = log["motor_speed"] / 62.6
    theta = np.concatenate([[0.0], np.cumsum(0.5 * (omega[1:] + omega[:-1]) * np.diff(log.time))])
    expected = direction * (1.0 + 0.1 * np.cos(theta + 0.7)) * table(omega)
    torque = -62.6 * log["shaft_torque"]
    np.testing.assert_allclose(torque[floats], expected[floats], rtol=1e-4)


def test_ripple_has_the_period_of_one_revolution_of_the_output(nominal: ParameterSet) -> None:
    log, late = steady(nominal, 1.0)
    torque = -62.6 * log["shaft_torque"][late]
    friction = table(np.float64(OUTPUT))
    assert 0.5 * np.ptp(torque) == pytest.approx(0.1 * friction, rel=0.01)
    assert np.mean(torque) == pytest.approx(friction, rel=0.01)
    above = torque > friction
    rising = log.time[late][1:][above[1:] & ~above[:-1]]
    assert np.diff(rising) == pytest.approx(2.0 * pi / OUTPUT, rel=0.015)  # a sample is 0.8 %


@pytest.mark.parametrize("phase", [0.0, 2.0, pi])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_gear_breaks_away_at_the_level_of_its_angle(
    nominal: ParameterSet, phase: float, direction: float
) -> None:
    eccentric = {"gear_eccentricity_amplitude": 0.5, "gear_eccentricity_phase": phase}
    bench = Piecewise({**nominal.values(), **eccentric})
    torque = 0.0
    for k in range(1, 6000):
        last = torque
        torque = 62.6 * abs(float(bench.to(1e-3 * k, direction * 2e-5 * k)[-1, 3]))
        if bench.x[GEAR] != 0.0:
            break
    assert last == pytest.approx((1.0 + 0.5 * cos(phase)) * 35.989, rel=0.02)


CORNERS = ((0.1, 0.0), (1.0, 150.0), (1.5, 150.0), (2.5, -120.0), (3.5, 0.0))


def test_mirrored_reference_and_phase_give_mirrored_run(nominal: ParameterSet) -> None:
    run = simulate(linear(*CORNERS, duration=5.0), {**nominal.values(), **ECCENTRIC})
    mirror = linear(*((t, -w) for t, w in CORNERS), duration=5.0)
    mirrored = {**ECCENTRIC, "gear_eccentricity_phase": -0.7}
    other = simulate(mirror, {**nominal.values(), **mirrored})
    for name in COMPARED:
        np.testing.assert_array_equal(run[name], -other[name])


def test_negative_amplitude_is_half_a_turn_of_phase(nominal: ParameterSet) -> None:
    inputs = linear(*CORNERS, duration=2.0)
    turned = {"gear_eccentricity_amplitude": -0.1, "gear_eccentricity_phase": 0.7 - pi}
    one = simulate(inputs, {**nominal.values(), **ECCENTRIC})
    other = simulate(inputs, {**nominal.values(), **turned})
    for name in COMPARED:
        np.testing.assert_allclose(one[name], other[name], atol=1e-6)


@settings(max_examples=20, deadline=None)
@given(
    speeds=st.tuples(*[st.floats(-2.0, 2.0)] * 2),
    gap=st.floats(-0.155, 0.155),
    phase=st.floats(-6.0, 6.0),
)
def test_free_bench_only_loses_energy(
    nominal: ParameterSet, speeds: tuple[float, float], gap: float, phase: float
) -> None:
    eccentric = {"gear_eccentricity_amplitude": 0.9, "gear_eccentricity_phase": phase}
    bench = Piecewise({**nominal.values(), **eccentric, "voltage_limit": 1e-12})
    bench.x[:8] = [0.0, 0.0, 0.0, 62.6 * speeds[0], 0.0, speeds[0], gap, speeds[1]]
    before = first = energy(bench.x)
    for k in range(1, 61):
        bench.to(0.01 * k, 0.0)
        now = energy(bench.x)
        assert now <= before + 1e-12 * (first + 1.0)
        before = now


def test_running_bench_settles_through_reversals(nominal: ParameterSet) -> None:
    bench = Bench(nominal, {"gear_eccentricity": {"amplitude": 0.9, "phase": 1.0}})
    bench.advance([200.0 * np.sin(4e-3 * k) for k in range(4000)])
    assert bench.unsettled == 0
