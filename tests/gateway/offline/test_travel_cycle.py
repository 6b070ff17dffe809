"""Energy of a travel cycle: by hand, and on the emulated bench against its own wheel torque."""

import numpy as np
import pytest
from click.testing import CliRunner

from gateway.cli import main
from gateway.configuration.config import Config
from gateway.offline.travel_cycle import Auxiliary, Leg, TravelCycle, work
from gateway.offline.truck_torque import truck_torques
from gateway.physics.window import Window
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop

HEAD = """name = "yard"
payload_kg = 1000
cycles_per_hour = 50
efficiency_percent = 80
recuperation_percent = 25
"""
LEG = '[[leg]]\nrecording = "none.rlrec"\ndirection = "forward"\ncount = 1\n'


def window(drum_speed, change):
    return Window(
        duration=0.5, shaft_torque=0.0, motor_speed=0.0,
        drum_speed=drum_speed, drum_speed_change=change,
    )  # fmt: skip


def cycle(rate=50.0):
    legs = [
        Leg(
            name="a", mass=3640.0, count=count, direction=direction,
            duration=20.0, distance=30.0, driving=16e3, braking=8e3,
        )
        for count, direction in ((1, "forward"), (2, "reverse"))
    ]  # fmt: skip
    return TravelCycle(
        name="yard", payload=1000.0, cycles_per_hour=rate, efficiency=0.8, recuperation=0.25,
        legs=tuple(legs), auxiliaries=(Auxiliary(what="lift", energy=9e3, count=2),),
    )  # fmt: skip


def test_work_by_hand():
    """From 0 to 2 rad/s in 0.5 s: 0.5 rad; on at 2 rad/s: 1 rad. 100 N m drive, then brake."""
    found = work([(window(2.0, 2.0), 100.0), (window(2.0, 0.0), -100.0)], drum_radius=0.5)
    assert found == pytest.approx(
        {"duration": 1.0, "distance": 0.75, "driving": 50.0, "braking": 100.0}
    )


def test_energy_of_an_hour_by_hand():
    """3 (16 / 0.8 - 0.25 8) = 54 kJ and 18 kJ: 72 kJ a cycle, 50 of them are 3.6 MJ = 1 kWh."""
    found = cycle()
    assert (found.travel, found.auxiliary) == pytest.approx((54e3, 18e3))
    assert found.power == pytest.approx(1.0)
    assert found.throughput == pytest.approx(50.0)
    assert found.to_json()["t_per_kwh"] == pytest.approx(50.0)
    assert "in reverse, driven forward on the bench" in str(found)


def test_60_s_of_legs_fit_60_times_into_an_hour_and_not_61_times():
    assert cycle(60.0).fits
    assert not cycle(61.0).fits
    assert "more than there is" in str(cycle(61.0))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("name = ", "yard.toml: Invalid value"),
        (HEAD, "no leg"),
        (HEAD.replace("80", "0") + LEG, "efficiency_percent: bad value, found 0.0"),
        (HEAD.replace("25", "101") + LEG, "recuperation_percent: bad value"),
        (HEAD.replace("1000", '"x"') + LEG, "payload_kg: bad value"),
        (HEAD.replace("payload_kg = 1000\n", "") + LEG, "payload_kg: bad value"),
        ("lift = 1\n" + HEAD + LEG, "unknown key, found 'lift'"),
        (HEAD + LEG.replace("forward", "up"), "direction: bad value, found 'up'"),
        (HEAD + LEG, "none.rlrec: No such file"),
        ("leg = 3\n" + HEAD, "leg: not a list of tables"),
    ],
)
def test_a_file_that_is_no_travel_cycle_is_refused_in_one_line(tmp_path, text, says):
    file = tmp_path / "yard.toml"
    file.write_text(text)
    result = CliRunner().invoke(main, ["cycle", str(file)])
    assert result.exit_code == 2, result.output
    assert says in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.slow
def test_work_of_a_run_is_that_of_the_emulated_bench_within_1_percent():
    loop = ClosedLoop(Config())
    loop.start()
    loop.run(9.0)
    states = [one.state for one in loop.outputs]
    found = work(truck_torques(loop.observations, states, loop.config, loop.map), 0.645)
    force, speed = np.array(loop.wheel_torque) / 0.1715, np.array(loop.drum_speed) * 0.645
    own = float(np.sum(np.maximum(force * speed, 0.0)) * SCAN)
    assert own > 1e4
    assert found["driving"] == pytest.approx(own, rel=0.01)
    assert found["distance"] == pytest.approx(float(np.sum(speed)) * SCAN, rel=0.01)
