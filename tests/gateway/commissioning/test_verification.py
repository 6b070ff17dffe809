"""The verification on the emulated bench: what is off is found by its own check, and how much."""

import pytest

from gateway.commissioning.verification import CHECKS, evaluate, verification_program
from gateway.configuration.config import Config
from tests.gateway.commissioning.fast_bench import FastBench

pytestmark = pytest.mark.slow
FRICTION = {"gear_coulomb_friction": 1.1, "gear_viscous_friction": 1.1}


def verified(names, speed_max=4830.0, factors=None, hidden=()):
    config = Config().with_values({"limits.speed_max_rpm": str(speed_max)})
    config = config.with_program(verification_program(config, names, repeats=1))
    run = FastBench(config, factors=factors or {}, hidden=hidden).drive()
    return {one.name: one for one in evaluate(run, names)}, evaluate(run, names)


def test_a_bench_as_configured_passes_every_check():
    _, checks = verified(list(CHECKS))
    assert [str(one) for one in checks if not one.holds] == []


def test_friction_10_percent_off_is_found_by_the_losses_and_not_by_the_torque():
    """10 % of 35.989 + 345.38 w^0.4418 at 1400 rpm, w = 2.342 rad/s: 53.9 N m, 83.6 N."""
    found, _ = verified(["losses", "torque"], 1500.0, FRICTION)
    assert not found["losses"].holds
    assert found["losses"].value == pytest.approx(83.6, rel=0.01)
    assert "losses +10.0" in found["losses"].what
    assert found["torque"].holds


def test_gain_of_the_torque_5_percent_off_is_found_by_the_torque():
    found, _ = verified(["losses", "torque"], 1500.0, hidden=["torque_sensor_gain:error=0.05"])
    assert not found["torque"].holds
    assert found["torque"].value == pytest.approx(5.0, rel=0.03)


def test_inertia_of_the_drum_3_percent_off_is_found_by_the_inertia():
    _, (worst, mean) = verified(["inertia"], factors={"drum_inertia": 1.03})
    assert not worst.holds
    assert not mean.holds
    assert mean.value == pytest.approx(3.0, rel=0.03)
