"""Key figures of a run against hand calculations and the independent bench's logs."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from gateway.cli.replay import command as replay
from gateway.offline.evaluation import agreement, cruise, road_speed, traction_energy

NOMINAL = Path(__file__).parents[2] / "data" / "bench_nominal"


def test_agreement_is_that_of_a_hand_calculation():
    # y = 0 1 2 3 4, e = 1 0 0 0 -1: rms = sqrt(2/5), span 4; sum |e| = 2, sum |y| = 10
    found = agreement(np.arange(5.0), np.array([-1.0, 1.0, 2.0, 3.0, 5.0]))
    assert found.val1 == pytest.approx(100 * (1 - 0.4**0.5 / 4))
    assert found.val2 == pytest.approx(80.0)


def test_cruise_is_the_longest_steady_stretch_of_at_least_five_seconds():
    time = np.arange(0.0, 30.0, 0.01)
    speed = np.interp(time, [0.0, 2.0, 8.0, 20.0, 24.0], [0.0, 0.0, 4.0, 4.0, 0.0])
    steady = cruise(time, speed)
    assert steady is not None
    assert time[steady][0] == pytest.approx(8.0, abs=0.3)
    assert time[steady][-1] == pytest.approx(20.0, abs=0.3)
    assert cruise(time[:1000], speed[:1000]) is None


def test_traction_energy_counts_only_what_drives():
    # 100 N at 2 m/s for 3 s = 600 J; the braking that follows costs nothing
    time = np.arange(0.0, 6.01, 0.01)
    force = np.where(time <= 3.0, 100.0, -100.0)
    assert traction_energy(time, force, np.full_like(time, 2.0)) == pytest.approx(600.0, rel=1e-9)


def test_truck_on_the_road_coasts_to_rest_and_stays_there():
    # 1000 kg, 500 N for 4 s against 100 N: 0.4 m/s2 -> 1.6 m/s; then -0.1 m/s2: at rest after 16 s
    time = np.arange(0.0, 30.0, 0.01)
    force = np.where(time <= 4.0, 500.0, 0.0)
    speed = road_speed(time, force, 1000.0, lambda v: 100.0 if v > 0.0 else 0.0)
    assert speed.max() == pytest.approx(1.6, abs=0.01)
    assert speed[time > 20.1].max() == 0.0
    assert speed[np.searchsorted(time, 12.0)] == pytest.approx(0.8, abs=0.01)


@pytest.mark.parametrize(("name", "load"), [("program6", 0), ("program6L", 1600)])
def test_log_of_a_truck_gives_its_force_and_energy(name, load):
    settings = ["regulator.name=thesis", "truck.crr=0.0117", f"truck.load_kg={load}"]
    options = [text for setting in settings for text in ("--set", setting)]
    result = CliRunner().invoke(replay, [str(NOMINAL / f"{name}.csv.gz"), "--json", "-", *options])
    answer = json.loads(result.output)
    # the wheel torque that the independent bench logged in cruise: 71.9974 and 103.6446 Nm
    logged = {0: 71.9974, 1600: 103.6446}[load] / 0.1715
    assert answer["force"]["target_newton"] == pytest.approx(logged, rel=1e-3)
    assert abs(answer["force"]["mean_error_newton"]) < 1.0
    assert abs(answer["energy"]["error_percent"]) < 2.0
