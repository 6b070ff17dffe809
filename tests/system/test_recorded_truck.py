"""What a recorded run of a truck tells: its error budget, and its indices of SAE J2951."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import gateway
from gateway import config_file
from gateway.cli import main
from gateway.configuration.config import Config
from gateway.recordings import recording
from gateway.recordings.header import map_of
from gateway.reports.certificate import document_in
from gateway.twin.wheel_torque import RecordedTorque, wheel_torque
from gateway.workflows.run_quality import quality_at_the_end
from plant_emulator import logs

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """Folder of a truck with a driver on the nominal bench, up to its cruise."""
    out = tmp_path_factory.mktemp("demo")
    options = ["--fast", "--load", "0", "--driver", "pi", "--duration", "15"]
    assert CliRunner().invoke(main, ["demo", *options, "--out", str(out)]).exit_code == 0
    return out


def test_wheel_torque_of_the_sensors_is_that_of_the_truck(driven):
    """The emulator knows its truck's torque; 72 N m in cruise, 390 N m while it speeds up."""
    found = recording.read(driven / "truck_3640kg.rlrec")
    config = config_file.load(driven / "truck_3640kg.toml")
    told = wheel_torque(found, config, map_of(found.header))
    true = logs.read(driven / "truck_3640kg.csv")
    for begin, end in ((4.0, 7.0), (11.0, 14.0)):
        inside = (true.time >= begin) & (true.time < end)
        expected = float(np.mean(true["wheel_torque"][inside]))
        assert np.mean(told[int(100 * begin) : int(100 * end)]) == pytest.approx(expected, rel=0.02)
    assert np.all(np.isnan(told[:180]))


def test_a_set_that_the_run_did_not_know_is_taken_for_the_whole_run(driven):
    """15 s of 100 scans. Under that set the gateway would have asked for other speeds."""
    found = recording.read(driven / "truck_3640kg.rlrec")
    config = config_file.load(driven / "truck_3640kg.toml")
    told = config.with_values({"regulator.torque_gain_percent": 9.0})
    assert len(wheel_torque(found, told, map_of(found.header))) == pytest.approx(1500, abs=20)


def test_a_truck_that_stops_later_than_the_recorded_one_brakes_on_as_that_did():
    """A locked wheel would stop 3640 kg within a scan, with more torque than a sensor has."""
    driver = RecordedTorque(torque=np.array([np.nan, 50.0, -300.0, np.nan]))
    assert driver.torques(0.01, 2.0) == (50.0, 0.0)
    assert driver.torques(0.03, 0.5) == (0.0, 300.0)
    assert driver.torques(0.09, 0.5) == (0.0, 300.0)
    assert driver.torques(0.03, 0.0) == driver.torques(0.0, 0.0) == (0.0, 1e6)


def test_a_torque_counts_until_it_drives_the_truck_faster_than_the_bench_may_turn():
    """1450 N against 450 N on 1000 kg: 1 m/s^2. 4830 rpm / 62.6 * 0.645 m are 5.2115 m/s."""
    truck = {"truck.mass_kg": 1000.0, "truck.f0_N": 450.0, "truck.wheel_radius_m": 0.2}
    config = Config().with_values(truck)
    driver = RecordedTorque(torque=np.full(1000, 0.2 * 1450.0))
    assert driver.samples_within(config) == 522
    assert RecordedTorque(torque=driver.torque[:500]).samples_within(config) == 500


def test_the_end_of_a_run_tells_the_indices_that_a_replay_tells(driven, tmp_path):
    path = driven / "truck_3640kg.rlrec"
    told = quality_at_the_end(path)
    replayed = gateway.replay(path)
    assert told == replayed.figures.quality
    assert "SAE J2951, drum over demand: " in replayed.summary()
    assert "SAE J2951, drum over road: " in gateway.replay(path.with_suffix(".csv")).summary()
    assert abs(told.distance) < 0.02
    other = tmp_path / "none.rlrec"
    other.write_bytes(b"no recording")
    assert quality_at_the_end(other) is None


def test_backlash_costs_the_nominal_bench_most(driven, tmp_path):
    answer = tmp_path / "budget.json"
    words = ["budget", str(driven / "truck_3640kg.rlrec"), "--json", str(answer)]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.output
    told = json.loads(answer.read_text())
    assert (told["schema"], told["largest"]) == ("budget/1", "backlash")
    assert told["judged_seconds"] == told["duration_seconds"] == pytest.approx(15.0, abs=0.2)
    parts = [*told["causes"], told["interaction"], told["left"]]
    for column in ("force_newton", "energy_percent", "speed_km_h"):
        assert sum(one[column] for one in parts) == pytest.approx(told["whole"][column])


def test_a_recording_that_is_none_is_refused_in_one_line(driven):
    result = CliRunner().invoke(main, ["budget", str(driven / "truck_3640kg.toml")])
    assert result.exit_code == 2
    assert "Traceback" not in result.output


def test_a_certificate_with_a_truck_shows_its_budget_and_is_verified(driven):
    """The page says how much of the run the budget judges, and --verify computes it again."""
    page = driven / "truck.html"
    truck = driven / "truck_3640kg.rlrec"
    made = CliRunner().invoke(main, ["certificate", str(truck), "--save", str(page)])
    assert (made.exit_code, made.stdout) == (1, f"not certified: see {page}\n")
    text = page.read_text("utf-8")
    (run,) = document_in(text)["runs"]
    assert run["budget"]["largest"] in {one["cause"] for one in run["budget"]["causes"]}
    judged = "first {judged_seconds:.1f} of {duration_seconds:.1f} s".format_map(run["budget"])
    assert f"Error budget against the road, {judged}" in text
    verified = CliRunner().invoke(main, ["certificate", "--verify", str(page)])
    assert (verified.exit_code, verified.stdout) == (0, "the certificate agrees with its files\n")
