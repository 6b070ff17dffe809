"""`gateway losses` as a user calls it: files in, map, table, picture and answer out; and live."""

import csv
import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gateway.cli import main
from gateway.config_file import load_friction
from gateway.friction.document import read_friction
from gateway.friction.law import friction_torque
from plant_emulator.emulator.process import EmulatorProcess
from tests.system.gateway_process import until, until_armed

DATA = Path(__file__).parents[2] / "data"
PROGRAM_2 = DATA / "bench_nominal" / "program2.csv.gz"
NOISY = [DATA / "bench_practice" / "practice_004" / f"program{k}.csv.gz" for k in (1, 2, 3)]


def losses(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["losses", *map(str, arguments)])


def table_3_1(omega: float) -> float:
    return 35.989 + 345.38 * omega**0.4418


def test_map_of_a_log_is_a_friction_file_that_tells_its_origin(tmp_path):
    file = tmp_path / "map.toml"
    result = losses(*NOISY, "--save", file)
    assert result.exit_code == 0, result.output
    friction = read_friction(load_friction(file)["friction"], "map")
    for omega in (2.0, 4.0, 6.0):
        assert friction_torque(omega, friction) == pytest.approx(table_3_1(omega), rel=3e-3)
    assert friction.reference_temperature_celsius == pytest.approx(32.5, abs=0.6)
    origin = tomllib.loads(file.read_text())["measured"]
    assert origin["sources"] == ["program1.csv.gz", "program2.csv.gz", "program3.csv.gz"]
    assert origin["date"].tzinfo is not None
    low, high = origin["shell_temperature_degC"]
    assert 31.5 < low <= high < 33.5
    assert 0.05 < origin["torque_standard_error_percent"] < 0.5
    assert len(origin["steady"]) == 9


def test_a_log_without_shell_temperature_says_so(tmp_path):
    result = losses(PROGRAM_2, "--save", tmp_path / "map.toml")
    assert "shell temperature unknown" in result.output
    origin = tomllib.loads((tmp_path / "map.toml").read_text())["measured"]
    assert origin["shell_temperature_degC"] == []


def test_table_is_for_a_spreadsheet_and_picture_is_a_picture(tmp_path):
    table, plot = tmp_path / "losses.csv", tmp_path / "losses.png"
    assert losses(PROGRAM_2, "--csv", table, "--plot", plot).exit_code == 0
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 5
    for row in rows:
        omega = float(row["motor_speed_rpm"]) * 0.104719755 / 62.6
        assert float(row["gear_speed_rad_s"]) == pytest.approx(omega, rel=1e-4)
        assert float(row["friction_torque_Nm"]) == pytest.approx(table_3_1(omega), rel=1e-3)
        assert float(row["rim_force_N"]) == pytest.approx(table_3_1(omega) / 0.645, rel=1e-3)
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_machine_gets_nothing_but_the_answer():
    answer = json.loads(losses(PROGRAM_2, "--json", "-").stdout)
    assert answer["schema"] == "losses/1"
    assert "forward only" in answer["direction"]
    for name, value in (("coulomb", 35.989), ("viscous", 345.38), ("exponent", 0.4418)):
        entry = answer["friction"][name]
        assert abs(entry["value"] - value) < 3.0 * entry["standard_error"]


def test_zero_of_the_sensor_in_the_configuration_counts(tmp_path):
    config = tmp_path / "bench.toml"
    config.write_text("[regulator]\ntorque_offset_Nm = 0.5\n")
    found = json.loads(losses(PROGRAM_2, "-c", config, "--json", "-").stdout)["sections"]
    assert found[0]["friction_torque_Nm"] == pytest.approx(496.58 + 62.6 * 0.5, rel=1e-3)


def test_a_gear_ratio_that_is_not_the_benchs_is_told_by_name(tmp_path):
    config = tmp_path / "bench.toml"
    config.write_text("[bench]\ngear_ratio = 31.3\n")
    result = losses(PROGRAM_2, "-c", config)
    assert result.exit_code == 2
    assert "do not belong together" in result.stderr


def flipped(folder: Path) -> Path:
    import gzip

    with gzip.open(PROGRAM_2, "rt", newline="") as file:
        rows = list(csv.reader(file))
    column = rows[0].index("shaft_torque_Nm")
    for row in rows[1:]:
        row[column] = str(-float(row[column]))
    path = folder / "flipped.csv"
    with path.open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    return path


def test_a_log_of_the_wrong_sign_writes_no_map(tmp_path):
    result = losses(flipped(tmp_path), "--save", tmp_path / "map.toml")
    assert result.exit_code == 2
    assert "flipped.csv: the sign of the shaft torque is wrong" in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "map.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "missing LOG|RECORDING, or -c CONFIG"),
        ([PROGRAM_2, "--speeds", "200,400,800,1600"], "for a live sweep"),
        (["-c", "x.toml", "--speeds", "200,fast"], "expected numbers separated by commas"),
        ([DATA / "bench_nominal" / "program1.csv.gz"], "program1.csv.gz: too few steady speeds"),
        ([DATA / "bench_nominal" / "program6.csv.gz"], "a truck stands on the drum"),
        (["no_such.csv"], "no_such.csv: No such file"),
    ],
)
def test_what_shows_no_losses_is_one_line_and_exit_code_2(arguments, says):
    result = losses(*arguments)
    assert result.exit_code == 2
    assert says in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_sweep_that_check_would_refuse_does_not_begin(tmp_path):
    config = tmp_path / "bench.toml"
    config.write_text("[plc]\nport = 1\ntimeout_ms = 90\n")
    result = losses("-c", config)
    assert result.exit_code == 2
    assert "plc.timeout_ms" in result.stderr


def live(folder: Path, port: int, *options: object) -> "subprocess.Popen[str]":
    config = folder / "bench.toml"
    config.write_text(f'[plc]\nport = {port}\n[recording]\ndir = "{folder}"\n')
    slow = ("--speeds", "200,320,450,600", "--hold", "4")
    return subprocess.Popen(
        [sys.executable, "-m", "gateway", "losses", "-c", config, *slow, *map(str, options)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.slow
@pytest.mark.realtime
def test_live_sweep_ends_by_itself_and_leaves_the_map(tmp_path):
    """The truck on the emulated drum has a driver; in mode speed he does not drive."""
    file = tmp_path / "map.toml"
    with EmulatorProcess(truck_mass=3640.0, driver="pi") as emulator:
        process = live(tmp_path, emulator.port, "--save", file)
        until_armed(emulator)
        emulator.set_remote(on=True)
        until(lambda: emulator.status()["state"] == "SPEED")
        output, errors = process.communicate(timeout=60)
        assert process.returncode == 0, errors
        until(lambda: emulator.status()["state"] == "READY")
    assert "no truck on the drum; 4 speeds" in errors
    assert "friction known to" in output
    friction = read_friction(load_friction(file)["friction"], "map")
    for omega in (0.35, 0.6, 0.95):
        assert friction_torque(omega, friction) == pytest.approx(table_3_1(omega), rel=3e-3)


@pytest.mark.slow
@pytest.mark.realtime
def test_sweep_that_the_operator_ends_leaves_no_map_and_exit_code_1(tmp_path):
    file = tmp_path / "map.toml"
    with EmulatorProcess(truck_mass=None) as emulator:
        process = live(tmp_path, emulator.port, "--save", file)
        until_armed(emulator)
        emulator.set_remote(on=True)
        until(lambda: emulator.status()["motor_speed"] > 10.0)
        emulator.set_remote(on=False)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "the sweep did not come to its end: stopped by the operator" in errors
    assert ".rlrec" in errors
    assert not file.exists()
