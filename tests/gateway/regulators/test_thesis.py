"""The thesis's regulator, against the logs of an independent bench that ran the same equations.

There the reference was computed from the averaged torque at a 10 ms cycle, with C_rr = 0.0117 and
C_rr,v = 9.3882e-6 for both trucks (seen in the logs: at constant speed d/dt of the reference is
reproduced within 0.02 N m at the drum).
"""

import gzip
from pathlib import Path

import numpy as np
import pytest

from gateway.configuration.config import Config
from gateway.physics.window import Window
from gateway.regulators import thesis

LOGS = Path(__file__).parents[2] / "data" / "bench_nominal"


def read(name):
    with gzip.open(LOGS / f"{name}.csv.gz", "rt") as file:
        return np.genfromtxt(file, delimiter=",", names=True)


def replayed(log, load_mass):
    """Reference that our regulator computes from the logged torque and drum speed [rad/s]."""
    values = {"truck.crr": "0.0117", "truck.load_kg": str(load_mass)}
    params = thesis.Params.of(Config().with_values(values))
    state, references = thesis.seed(params, 0.0, 0.0), [0.0]
    torque = 0.5 * (log["shaft_torque_Nm"][1:] + log["shaft_torque_Nm"][:-1])
    drum = log["drum_speed_rad_s"]
    for row in range(1, len(log)):
        seen = Window(
            duration=0.01,
            shaft_torque=float(torque[row - 1]),
            motor_speed=float(log["motor_speed_rad_s"][row]),
            drum_speed=float(drum[row]),
            drum_speed_change=float(drum[row] - drum[row - 1]),
        )
        state, demand = thesis.update(params, state, seen)
        references.append(demand.speed)
    return np.array(references)


@pytest.mark.parametrize(("name", "load_mass"), [("program6", 0.0), ("program6L", 1600.0)])
def test_reference_of_the_independent_bench_is_reproduced(name, load_mass):
    log = read(name)
    error = replayed(log, load_mass) - log["speed_reference_rad_s"]
    span = float(np.ptp(log["speed_reference_rad_s"]))
    assert np.sqrt(np.mean(error**2)) / span < 0.005
    assert np.abs(error).max() / span < 0.01


@pytest.mark.parametrize(("name", "load_mass"), [("program6", 0.0), ("program6L", 1600.0)])
def test_slope_of_the_reference_in_cruise_is_reproduced(name, load_mass):
    """0.02 N m at the drum, of 800 N m friction and 270 N m road load that nearly cancel."""
    log = read(name)
    cruise = (log["time_s"] > 10.0) & (log["time_s"] < 21.0)
    error = replayed(log, load_mass)[cruise] - log["speed_reference_rad_s"][cruise]
    drift = np.polyfit(log["time_s"][cruise], error, 1)[0] / 62.6
    assert abs(drift) * (3640.0 + load_mass) * 0.645**2 < 0.05


def test_rho_is_the_share_of_drum_and_gear_in_the_emulated_inertia():
    """By hand: (0.02242 + 312.69) / (m 0.645^2)."""
    for mass, rho in (
        (400.0, 1.88),
        (752.0, 1.0),
        (1500.0, 0.50),
        (3640.0, 0.207),
        (5240.0, 0.143),
    ):
        config = Config().with_values({"truck.mass_kg": str(mass)})
        assert thesis.Params.of(config).rho == pytest.approx(rho, rel=0.005)


def grown(grade, **seen):
    """Change of the integral over one window, from a seed at 200 rad/s of the motor."""
    params = thesis.Params.of(Config().with_values({"truck.grade_percent": str(grade)}))
    state = thesis.seed(params, 200.0, 0.0)
    given = {"shaft_torque": 0.0, "motor_speed": 200.0, "drum_speed": 0.0, "drum_speed_change": 0.0}
    after, _ = thesis.update(params, state, Window(duration=0.01, **(given | seen)))
    return after.integral - state.integral


INERTIA = 3640.0 * 0.645**2


@pytest.mark.parametrize("drum_speed", [3.0, 1.0, -1.0])
def test_a_grade_pulls_the_rolling_truck_back_and_its_descent_on(drum_speed):
    """m g sin(atan 0.05) r_d = 1150.16 N m of gravity, whichever way the truck rolls."""
    gravity = 3640.0 * 9.81 * 0.0499376 * 0.645
    up, down = grown(5.0, drum_speed=drum_speed), grown(-5.0, drum_speed=drum_speed)
    assert up - down == pytest.approx(-2.0 * gravity / INERTIA * 0.01, rel=1e-5)


@pytest.mark.parametrize("grade", [0.0, 5.0])
@pytest.mark.parametrize("change", [0.01, 1.0, -1.0])
def test_at_the_instant_of_standstill_friction_and_road_vanish(grade, change):
    """sgn(0) = 0, and gravity is held by the brake: 15 N m at the sensor are 939 at the drum."""
    passing = grown(grade, shaft_torque=15.0, drum_speed_change=change)
    assert passing == pytest.approx(939.0 / INERTIA * 0.01)


@pytest.mark.parametrize("shaft_torque", [15.0, -15.0])
def test_a_drum_that_stands_moves_no_truck_however_the_shaft_is_wound(shaft_torque):
    assert grown(5.0, shaft_torque=shaft_torque) == 0.0


@pytest.mark.parametrize("drum_speed", [1.0, -1.0])
def test_a_drum_that_turns_evenly_does_not_stand(drum_speed):
    wound = grown(0.0, drum_speed=drum_speed, shaft_torque=15.0)
    plain = grown(0.0, drum_speed=drum_speed)
    assert wound - plain == pytest.approx(939.0 / INERTIA * 0.01)
