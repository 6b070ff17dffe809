"""The demo as a user calls it: the bench in its own process, the gateway, a real socket.

Figures are limits that every run has to keep. The fast runs use the same loop, server and socket
and no clock; the others keep real time.
"""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from gateway.cli import main
from gateway.cycle.supervisor import State
from gateway.recordings import recording
from plant_emulator import logs

pytestmark = pytest.mark.slow

TABLE = Path(__file__).parents[2] / "plant_emulator/parameter_sets/thesis_table_3_1.toml"


def demo(out: Path, *options: str) -> list[dict]:
    result = CliRunner().invoke(main, ["demo", "--out", str(out), *options])
    assert result.exit_code == 0, result.output
    summary = json.loads((out / "summary.json").read_text())
    assert summary["schema"] == "demo/1"
    return summary["runs"]


def test_replayed_torque_gives_both_trucks_the_speed_of_the_road(tmp_path):
    runs = demo(tmp_path, "--fast", "--regulator", "compensated")
    assert [run["truck_kg"] for run in runs] == [3640.0, 5240.0]
    for run in runs:
        assert run["velocity"]["val1"] >= 98.4
        assert run["velocity"]["val2"] >= 98.3
        assert run["stop_reason"] == "REMOTE_OFF"


def test_learned_regulator_knows_in_the_second_run_what_the_first_has_shown(tmp_path):
    """Free through the backlash, the drum meets the gear with 90 N m at the shaft and more."""
    options = ("--fast", "--regulator", "learned", "--repeats", "2", "--load", "0")
    (after,) = demo(tmp_path, *options)
    (before,) = json.loads((tmp_path / "summary.json").read_text())["earlier"]
    assert before["shaft_torque_Nm"]["min"] < -85.0
    assert after["shaft_torque_Nm"]["min"] > -60.0
    assert after["velocity"]["val1"] >= 99.2
    assert after["velocity"]["val2"] >= 99.7


@pytest.mark.parametrize(("regulator", "period"), [("thesis", "20"), ("compensated", "50")])
def test_slower_poll_gives_a_truck_the_speed_of_the_road(tmp_path, regulator, period):
    """Each truck at each period: test_the_drum_goes_as_the_truck_would_on_the_road."""
    options = ("--regulator", regulator, "--period", period)
    (run,) = demo(tmp_path, "--fast", "--load", "1600", *options)
    assert run["truck_kg"] == 5240.0
    assert run["velocity"]["val1"] >= 97.8
    assert run["stop_reason"] == "REMOTE_OFF"


@pytest.mark.parametrize(("regulator", "load"), [("thesis", "0"), ("compensated", "1600")])
def test_driver_who_holds_his_speed_feels_road_load_and_spends_its_energy(
    tmp_path, regulator, load
):
    options = ("--driver", "pi", "--regulator", regulator, "--load", load)
    (run,) = demo(tmp_path, "--fast", *options)
    # by hand: m g (0.0117 + 9.3882e-6 v / r_d), v = 14 km/h, r_d = 0.645 m
    road_load = run["truck_kg"] * 9.81 * (0.0117 + 9.3882e-6 * 14 / 3.6 / 0.645)
    assert run["force"]["target_newton"] == pytest.approx(road_load, rel=2e-3)
    assert abs(run["force"]["mean_error_newton"]) < 0.03 * road_load
    assert abs(run["energy"]["error_percent"]) < 2.0


@pytest.mark.realtime
@pytest.mark.slow
def test_truck_goes_as_on_the_road_in_real_time(tmp_path):
    (run,) = demo(tmp_path, "--regulator", "compensated", "--load", "1600")
    assert run["truck_kg"] == 5240.0
    assert run["velocity"]["val1"] >= 98.4
    assert run["velocity"]["val2"] >= 98.3
    assert run["cycles"] == pytest.approx(3000, rel=0.02)


def test_instantaneous_torque_aliases_with_the_staircase_as_the_thesis_did(tmp_path):
    """Integrated torque has to reach 97.8 at this period too.

    How far below instantaneous torque falls depends on where in the period its sample meets the
    torque pulse of the staircase: on dead time and scan, modulo the period.
    """
    options = ("--regulator", "thesis", "--torque", "instantaneous", "--period", "50")
    (run,) = demo(tmp_path, "--fast", "--load", "1600", *options)
    assert run["velocity"]["val1"] < 97.0


@pytest.mark.parametrize(
    ("mode", "code"), [(["--fast"], 0), pytest.param([], 1, marks=pytest.mark.realtime)]
)
def test_run_that_the_gateway_trips_fails_and_leaves_its_figures(tmp_path, mode, code):
    """A gear of 40 instead of 62.6: motor and drum move apart."""
    (tmp_path / "geared.toml").write_text(TABLE.read_text().replace("value = 62.6", "value = 40.0"))
    command = ["demo", "--out", str(tmp_path), *mode, "--load", "0", "--duration", "10"]
    command += ["--bench-parameters", str(tmp_path / "geared.toml")]
    result = CliRunner().invoke(main, command)
    assert result.exit_code == 1
    error = result.stderr.splitlines()[-1]
    assert f"3640 kg: stopped by GEAR_MODEL, exit code {code} of the gateway" in error
    [run] = json.loads((tmp_path / "summary.json").read_text())["runs"]
    assert run["stop_reason"] == "GEAR_MODEL"
    assert list(tmp_path.glob("*.rlrec"))


@pytest.mark.realtime
def test_real_time_run_leaves_everything_behind(tmp_path):
    (run,) = demo(tmp_path, "--load", "0", "--duration", "12")
    assert run["missed_deadlines"] <= 0.01 * run["cycles"]
    assert 0.0 < run["latency_ms"]["p50"] <= run["latency_ms"]["p99"] <= run["latency_ms"]["max"]
    assert run["latency_ms"]["p50"] < 10.0
    (file,) = tmp_path.glob("*.rlrec")
    states = [State(int(state)) for state in recording.read(file).records["state"]]
    passed = [state for k, state in enumerate(states) if not k or state is not states[k - 1]]
    assert passed == [
        *(State.CONNECT, State.SHADOW, State.ARMED, State.RUN, State.RAMPDOWN, State.SAFE),
        State.OFF,
    ]
    log = logs.read(tmp_path / "truck_3640kg.csv")
    assert log.time[0] == 0.0
    assert log.time[-1] == pytest.approx(12.0, abs=0.011)
    assert log["drum_speed"].max() * 0.645 * 3.6 == pytest.approx(14.0, abs=0.5)
    assert (tmp_path / "demo.png").read_bytes().startswith(b"\x89PNG")
