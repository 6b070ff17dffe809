"""A parameter set with an effect gives the truck its road load back, on a bench with that effect.

The force that the truck feels is that of the emulator, which has laws and code of its own.
"""

from dataclasses import replace

import numpy as np
import pytest

from gateway.config_file import with_values
from gateway.configuration.config import Config
from gateway.cycle.supervisor import State
from gateway.offline.figures import cruise_force
from plant_emulator import effects, parameter_sets
from plant_emulator.simulation.truck import Forklift, driver_of
from register_maps.timing import SCAN
from tests.gateway.closed_loop import PARAMETERS, ClosedLoop

TRUCK = Forklift(mass=3640.0)
CRUISING = 20.0
"""[s] The truck of the cycle brakes only later."""


def cruise_error(config, chosen):
    """Error of the force on the truck in cruise over its road load [%]."""
    loop = ClosedLoop(config, effects=chosen, driver=lambda truck: driver_of("pi", truck))
    loop.start()
    loop.run(CRUISING)
    assert loop.last.state is State.RUN
    time = SCAN * np.arange(len(loop.drum_speed))
    force = np.array(loop.wheel_torque) / TRUCK.wheel_radius
    felt = cruise_force(time, np.array(loop.drum_speed) * 0.645, force, TRUCK.road_load)
    return 100.0 * felt.mean_error / felt.target


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "load_dependent_gear_loss",
        "drum_bearing_friction",
        "gear_oil_temperature",
        "torque_sensor_gain",
        "torque_sensor_offset",
        "torque_sensor_lag",
    ],
)
def test_force_in_cruise_is_within_3_percent_of_the_road_load(tmp_path, name):
    chosen = effects.parse((name,))
    path = tmp_path / "set.toml"
    parameter_sets.save(replace(PARAMETERS, effects=chosen), path)
    told = with_values(Config(), {"regulator.friction": str(path)})
    assert abs(cruise_error(told, chosen)) < 3.0


@pytest.mark.slow
def test_without_the_set_the_truck_feels_the_bearings():
    """20 + 5 x 6.03 N m of the bearings at 0.645 m are 78 N of 420 N."""
    assert cruise_error(Config(), effects.parse(("drum_bearing_friction",))) > 15.0
