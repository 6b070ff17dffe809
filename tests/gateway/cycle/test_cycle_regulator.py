"""The tick tells its regulator what the limits have let pass."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.cycle.supervisor import State
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop
from tests.gateway.cycle.disturbances import CONFIG, again


def slower(loop, reading):
    """A motor 60 rad/s behind its setpoint; 400 rpm = 41.9 rad/s are allowed."""
    return replace(reading, motor_speed=reading.motor_speed - 60.0)


UNAWARE = {"bench.motor_inertia_kg_m2": 0.001, "plausibility.torque_Nm": 100.0}
"""A motor whose speed may jump: these tests let it."""


@pytest.fixture
def unaware():
    loop = ClosedLoop(CONFIG.with_values(UNAWARE))
    loop.start()
    loop.run(4.5)
    return loop


@pytest.fixture
def thesis():
    loop = ClosedLoop(CONFIG.with_values({"regulator.name": "thesis"} | UNAWARE))
    loop.start()
    loop.run(4.5)
    return loop


def reference_of(loop):
    """xi (rho theta_d' + integral), the motor speed that the thesis's regulator stands at."""
    drum = loop.observations[-1].measurement.drum_speed
    return 62.6 * (312.71242 / (3640.0 * 0.645**2) * drum + loop.state.regulator.integral)


def test_a_regulator_goes_on_from_what_the_deviation_has_let_pass(thesis):
    thesis.disturb = slower
    thesis.run(SCAN)
    passed = thesis.last.setpoint.speed_setpoint
    assert passed < thesis.last.demand - 1.0
    assert reference_of(thesis) == pytest.approx(passed)


@pytest.mark.parametrize("kind", ["thesis", "unaware"])
def test_a_regulator_is_told_once_of_a_demand_that_was_not_passed(kind, request):
    loop = request.getfixturevalue(kind)
    loop.disturb = slower
    loop.run(SCAN)
    told = loop.state.regulator
    loop.disturb = again
    loop.run(3 * SCAN)
    assert loop.last.state is State.RUN
    assert loop.state.regulator == told


def lose_number(loop):
    lost = replace(loop.state.regulator, integral=np.nan)
    loop.state = replace(loop.state, regulator=lost)


def test_a_regulator_that_has_lost_its_number_begins_at_the_measured_speed(thesis):
    lose_number(thesis)
    thesis.run(SCAN)
    assert not np.isfinite(thesis.last.demand)
    measured = thesis.observations[-1].measurement.motor_speed
    assert reference_of(thesis) == pytest.approx(measured)


def test_a_regulator_is_told_of_no_limit_outside_a_run():
    """In shadow a standing setpoint is far below what the regulator of a turning bench wants."""
    loop = ClosedLoop(CONFIG.with_values({"regulator.name": "thesis"}), shadow=True)
    loop.disturb = lambda _, reading: replace(reading, motor_speed=200.0, drum_speed=200.0 / 62.6)
    loop.run(0.1)
    lose_number(loop)
    loop.run(0.1)
    assert not np.isfinite(loop.state.regulator.integral)
