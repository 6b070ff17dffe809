"""Error budget of a run: with one cause present that one is named, and the budget adds up."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.config_file import with_values
from gateway.configuration.config import Config
from gateway.twin import closed_loop
from gateway.twin.budget import NO_ERRORS, Budget, Errors, budget, errors
from gateway.twin.closed_loop import Twin, TwinRun
from plant_emulator import effects, parameter_sets
from plant_emulator.simulation.truck import Forklift, ReplayedTorque
from register_maps import load
from register_maps.timing import SCAN

THESIS = parameter_sets.load()
IDEAL = {
    "regulator.under_compensation_percent": 0.0,
    "regulator.under_compensation_slow_percent": 0.0,
    "regulator.lead_s": 0.021053,
    "regulator.breakaway_Nm": 0.0,
    "bench.dead_time_ms": 0.0,
    "bench.backlash_half_gap_rad": 0.0,
}
"""What the gateway knows of a bench without dead time and backlash; it leads by the drive's lag."""
PERFECT = THESIS.with_values({"dead_time": 0.0, "backlash_half_gap": 0.0})


DURATION = 9.0
"""[s] The truck sets off, crosses the backlash and comes to its speed."""


def budget_of(values, parameters, folder):
    config = Config().with_values(IDEAL | values)
    path = folder / "set.toml"
    parameter_sets.save(parameters, path)
    told = with_values(config, {"regulator.friction": str(path)})
    twin = Twin(config=config, parameters=parameters, map=load("bench_float32"))
    driver = ReplayedTorque(Forklift(mass=3640.0))
    return budget(twin, told, lambda one: closed_loop.run(one, lambda: driver, DURATION))


CASES = {
    "friction and inertia": ({}, PERFECT.with_values({"gear_viscous_friction": 1.1 * 345.38})),
    "dead time": ({"bench.dead_time_ms": 64.0}, PERFECT.with_values({"dead_time": 0.064})),
    "torque sensor": (
        {},
        replace(PERFECT, effects=effects.parse(("torque_sensor_gain:error=-0.05",))),
    ),
    "margin at the start": ({"regulator.breakaway_Nm": 30.0}, PERFECT),
    "backlash": (
        {"bench.backlash_half_gap_rad": 0.15073},
        PERFECT.with_values({"backlash_half_gap": 0.15073}),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("cause", CASES)
def test_the_only_cause_is_named_and_no_other_costs_anything(cause, tmp_path):
    found = budget_of(*CASES[cause], tmp_path)
    assert found.largest == cause
    assert all(one == NO_ERRORS for name, one in found.alone.items() if name != cause)


@pytest.mark.slow
def test_two_causes_and_their_interaction_are_the_whole_within_5_percent(tmp_path):
    """Friction 10 % up and a torque sensor 5 % low; the lag of the drive is what is left."""
    both = replace(CASES["friction and inertia"][1], effects=CASES["torque sensor"][1].effects)
    found = budget_of({}, both, tmp_path)
    costly = {name for name, one in found.alone.items() if one != NO_ERRORS}
    assert costly == {"friction and inertia", "torque sensor"}
    explained = found.interaction.speed + sum(one.speed for one in found.alone.values())
    assert explained == pytest.approx(found.whole.speed, rel=0.05)
    assert abs(found.left.force) < 0.05 * abs(found.whole.force)


def test_errors_by_hand():
    """A bench that resists 100 N too much: 0.5 m/s after 10 s of 600 N on 1000 kg, not 1.5."""
    config = Config().with_values(
        {"truck.mass_kg": 1000.0, "truck.f0_N": 450.0, "truck.wheel_radius_m": 0.2}
    )
    twin = Twin(config=config, parameters=THESIS, map=load("bench_int16"))
    time = SCAN * np.arange(1001)
    run = TwinRun(
        time=time,
        drum_speed=0.05 * time / THESIS.value("drum_radius"),
        wheel_torque=np.full_like(time, 0.2 * 600.0),
    )
    found = errors(twin, run)
    assert found.force == pytest.approx(100.0)
    assert found.energy == pytest.approx(100.0 * (0.25 / 0.75 - 1.0), abs=0.1)
    assert found.speed == pytest.approx(3.6 * 1.0 / np.sqrt(3.0), rel=0.03)


def test_interaction_is_what_the_causes_cost_beyond_their_sum():
    def of(size):
        return Errors(force=size, energy=0.0, speed=size)

    found = Budget(whole=of(10.0), alone={"a": of(2.0), "b": of(5.0)}, left=of(1.0))
    assert found.interaction == of(2.0)
    assert found.largest == "b"
