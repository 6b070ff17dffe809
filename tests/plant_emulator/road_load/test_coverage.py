"""Coverage of the 95 % intervals, for trucks that an independent integrator simulates.

ROAD_REPEATS is the number of trucks. A figure needs 60 or more, for instance
ROAD_REPEATS=100 python -m pytest -s tests/plant_emulator/road_load/test_coverage.py
"""

import os

import numpy as np
import pytest

from plant_emulator.road_load.answer import RoadAnswer, answer_of
from plant_emulator.road_load.fit import fit
from plant_emulator.road_load.run import prepare
from plant_emulator.road_load.signal import signal
from plant_emulator.road_load.truck_model import Truck
from tests.plant_emulator.road_load.road_simulator import Truth, draw_truth, record

NAMES = {
    "crr": "crr",
    "crr_v": "crr_v",
    "efficiency": "efficiency",
    "velocity_clock_ahead_s": "ahead",
    "clock_ppm": "ppm",
    "torque_offset_Nm": "offset",
    "torque_gain": "gain",
}


def identify(truth: Truth, seed: int) -> RoadAnswer:
    torque, velocity = record(truth, seed)
    run = prepare(
        signal(*torque, "torque"), signal(*velocity, "velocity", rest=0.0), Truck(mass=truth.mass)
    )
    return answer_of(fit(run, 0.02))


def distances(truth: Truth, found: RoadAnswer) -> list[float]:
    """Estimate minus truth, in standard errors."""
    return [
        (found.estimates[key].value - getattr(truth, name)) / found.estimates[key].standard_error
        for key, name in NAMES.items()
    ]


@pytest.mark.slow
def test_95_percent_intervals_cover_the_truth_at_their_rate() -> None:
    count = int(os.environ.get("ROAD_REPEATS", "8"))
    trucks = [draw_truth(seed) for seed in range(1000, 1000 + count)]
    found = [identify(truth, seed) for seed, truth in enumerate(trucks)]
    assert all(one.converged for one in found)
    far = np.array([distances(*pair) for pair in zip(trucks, found, strict=True)])
    covered = np.abs(far) < 1.959964
    print(dict(zip(NAMES, covered.mean(axis=0).round(3).tolist(), strict=True)), covered.mean())
    # The 7 intervals of a truck are correlated, so few trucks need a wider band.
    slack = 0.05 if count < 60 else 0.0
    assert 0.90 - slack <= covered.mean() <= 0.99 + slack


@pytest.mark.slow
@pytest.mark.parametrize(
    "loggers",
    [
        {"torque_rate": 200.0, "velocity_rate": 400.0},
        {"torque_rate": 1000.0, "velocity_rate": 100.0},
        {"torque_rate": 50.0, "velocity_rate": 50.0},
        {"ahead": 1.5, "ppm": -80.0},
        {"torque_noise": 0.0, "velocity_noise": 0.0},
    ],
)
def test_other_loggers_give_the_same_truck(loggers: dict[str, float]) -> None:
    truth = Truth(**loggers)
    found = identify(truth, 1)
    assert found.converged
    assert np.max(np.abs(distances(truth, found))) < 3.5


@pytest.mark.slow
def test_waves_of_the_road_widen_the_intervals() -> None:
    """A grade of 0.2 permille (waves of 0.5 mm) outweighs the load cell's noise."""
    level, uneven = Truth(), Truth(grade=2e-4)
    found = identify(uneven, 1)
    assert found.converged
    assert np.max(np.abs(distances(uneven, found))) < 3.0
    error = identify(level, 1).estimates["crr"].standard_error
    assert found.estimates["crr"].standard_error > 2.0 * error


@pytest.mark.slow
def test_a_road_too_steep_to_be_level_is_reported() -> None:
    found = identify(Truth(grade=5e-3), 1)
    assert not found.converged
    assert "level road" in found.problems[0]


def test_without_braking_the_efficiency_is_as_unsure_as_the_gain() -> None:
    """2 % of 0.9 is 0.018; with braking it is 0.0002."""
    found = identify(Truth(targets=((2.0, 4.0),), duration=14.0), 1)
    assert found.estimates["efficiency"].standard_error == pytest.approx(0.018, rel=0.1)
    assert any(text.startswith("efficiency from torque_gain") for text in found.not_separable)
    assert any(text.startswith("crr from crr_v") for text in found.not_separable)


@pytest.mark.slow
def test_a_log_that_begins_on_the_move_needs_no_standstill() -> None:
    truth = Truth()
    (torque_time, torque), (time, velocity) = record(truth, 2)
    run = prepare(
        signal(torque_time[3000:15000], torque[3000:15000], "torque"),
        signal(time[7000:31000], velocity[7000:31000], "velocity", rest=0.0),
        Truck(mass=truth.mass),
    )
    found = answer_of(fit(run, 0.02))
    assert run.moving_start
    # The answer refers to the first stamp of the velocity, 7 s.
    shifted = Truth(ahead=truth.ahead + 7.0 * truth.ppm * 1e-6)
    assert found.converged
    assert np.max(np.abs(distances(shifted, found))) < 3.0
