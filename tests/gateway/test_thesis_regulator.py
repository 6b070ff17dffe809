"""The thesis's regulator, against the logs of an independent bench that ran the same equations.

There the reference was computed from the averaged torque at a 10 ms cycle, with C_rr = 0.0117 and
C_rr,v = 9.3882e-6 for both trucks (seen in the logs: at constant speed d/dt of the reference is
reproduced within 0.02 N m at the drum).
"""

import gzip
from pathlib import Path

import numpy as np
import pytest

from gateway.config import Config
from gateway.regulators import thesis
from gateway.regulators.window import Window

LOGS = Path(__file__).parents[1] / "data" / "bench_nominal"


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
