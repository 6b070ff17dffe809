"""`gateway ready` on the emulated bench over the socket, and `gateway verify` of a recording."""

import csv
import json
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from rich.console import Console

from gateway.cli import main
from gateway.commissioning.verification import CHECKS, verification_program
from gateway.configuration.config import Config
from gateway.configuration.program import Program, Ramp
from gateway.demo.operator import Session, operate_fast
from gateway.demo.view import Screen
from plant_emulator.emulator.process import EmulatorProcess
from tests.system.gateway_process import until_armed


def test_the_command_offers_every_check():
    from gateway.cli.verify import NAMES

    assert list(CHECKS) == NAMES


@pytest.mark.slow
@pytest.mark.realtime
def test_a_day_begins_with_one_page_and_a_line_in_the_history(tmp_path):
    with EmulatorProcess(truck_mass=None) as emulator:
        (tmp_path / "bench.toml").write_text(
            f'[plc]\nport = {emulator.port}\n[recording]\ndir = "runs"\n'
        )
        command = ["ready", "-c", "bench.toml", "--warm-up", "5", "--json", "ready.json"]
        process = subprocess.Popen(
            [sys.executable, "-m", "gateway", *command],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        until_armed(emulator)
        emulator.set_remote(on=True)
        output, errors = process.communicate(timeout=90)
    assert "no truck on the drum" in errors
    told = json.loads((tmp_path / "ready.json").read_text())
    assert told["schema"] == "readiness/1"
    held = {one["name"] for one in told["checks"] if one["holds"]}
    assert {"map", "disk", "tare", "zero", "sign", "ratio", "warm-up"} <= held, output
    assert process.returncode == int(not told["holds"])
    with (tmp_path / "runs" / "readiness.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == [one["name"] for one in told["checks"]]


def test_a_plc_that_does_not_answer_is_told_before_anything_is_asked_of_the_operator(tmp_path):
    """The port is that of an emulator which has ended."""
    with EmulatorProcess(truck_mass=None, speed=None) as emulator:
        port = emulator.port
    (tmp_path / "bench.toml").write_text(f"[plc]\nport = {port}\n")
    result = CliRunner().invoke(main, ["ready", "-c", str(tmp_path / "bench.toml")])
    assert result.exit_code == 1
    assert result.stderr.count(f"127.0.0.1:{port}") == 1
    assert "expected a PLC that answers" in result.stderr
    assert "remote" not in result.stderr


def test_a_bench_whose_registers_do_not_fit_is_told_before_anything_is_asked(tmp_path):
    """The PLC has the int16 map; the float32 map reads at addresses that it does not have."""
    with EmulatorProcess(truck_mass=None) as emulator:
        (tmp_path / "bench.toml").write_text(
            f'[plc]\nport = {emulator.port}\nmap = "bench_float32"\n'
        )
        result = CliRunner().invoke(main, ["ready", "-c", str(tmp_path / "bench.toml")])
    assert result.exit_code == 1
    assert "nothing was turned; registers that do not fit: " in result.stderr
    assert "remote" not in result.stderr


@pytest.mark.parametrize("content", [b"\xff\xfe", b"a,b\n1,2\n"])
def test_a_history_that_is_none_is_told_before_anything_is_asked(tmp_path, content):
    (tmp_path / "readiness.csv").write_bytes(content)
    with EmulatorProcess(truck_mass=None) as emulator:
        (tmp_path / "bench.toml").write_text(
            f'[plc]\nport = {emulator.port}\n[recording]\ndir = "{tmp_path}"\n'
        )
        result = CliRunner().invoke(main, ["ready", "-c", str(tmp_path / "bench.toml")])
    assert result.exit_code == 2
    assert "readiness.csv: no history of ready; expected a table with date, name" in result.stderr
    assert "remote" not in result.stderr


def recorded(folder: Path, names: list[str]) -> Path:
    """The recording of a verification up to 1500 rpm, without waiting for the clock."""
    with EmulatorProcess(truck_mass=None, speed=None) as emulator:
        values = {"plc.port": str(emulator.port), "limits.speed_max_rpm": "1500"}
        config = Config().with_values(values)
        return driven(folder, emulator, config, verification_program(config, names))


def driven(
    folder: Path, emulator: EmulatorProcess, config: Config, program: Program, late: float = 1.0
) -> Path:
    """The recording of a program, without waiting for the clock.

    late : time after its longest duration at which the operator turns remote off [s]
    """
    session = Session(
        config=config.with_program(program),
        file=folder / "run.toml",
        emulator=emulator,
        screen=Screen(Console(quiet=True), "", 1.0),
        duration=program.duration + late,
    )
    return operate_fast(session).recording


@pytest.mark.slow
def test_a_recording_is_verified_again_from_its_file_alone(tmp_path):
    path = recorded(tmp_path, ["losses", "torque"])
    result = CliRunner().invoke(main, ["verify", str(path), "--json", "-"])
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert [one["name"] for one in told["checks"]] == ["losses", "torque"]
    assert told["holds"]
    assert len(told["sha256"]) == 64
    losses, torque = (one["value"] for one in told["checks"])
    assert abs(losses) < 1.0
    assert abs(torque) < 0.5


def test_the_recording_of_another_run_is_refused_and_not_found_within_its_limits(tmp_path):
    """A program of two ramps has no step of any check."""
    with EmulatorProcess(truck_mass=None, speed=None) as emulator:
        steps = (Ramp(speed=20.0, rate=40.0, hold=0.5), Ramp(speed=0.0, rate=40.0, hold=0.0))
        config = Config().with_values({"plc.port": str(emulator.port)})
        path = driven(tmp_path, emulator, config, Program(name="short.csv", steps=steps))
    result = CliRunner().invoke(main, ["verify", str(path)])
    assert result.exit_code == 2
    assert "the run of short.csv; expected a recording of verify" in result.stderr


def test_the_part_of_a_run_is_not_verified(tmp_path):
    """The operator ends the run at the first speed of the sweep, at which nothing is wrong."""
    with EmulatorProcess(truck_mass=None, speed=None) as emulator:
        config = Config().with_values({"plc.port": str(emulator.port)})
        program = verification_program(config, ["losses", "torque"])
        path = driven(tmp_path, emulator, config, program, late=6.0 - program.duration)
    result = CliRunner().invoke(main, ["verify", str(path)])
    assert result.exit_code == 2
    assert "verification did not come to its end, found 'REMOTE_OFF'" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "expected -c CONFIG for a run on the live bench, or a RECORDING"),
        (["none.rlrec"], "none.rlrec: No such file"),
        (["-c", "none.toml"], "none.toml: No such file"),
        (["-c", "x.toml", "--only", "nothing"], "'nothing' is not one of"),
        (["a.rlrec", "--set", "truck.load_kg=1"], "a recording has had its own"),
        (["a.rlrec", "--repeats", "2"], "a recording has had its own"),
    ],
)
def test_wrong_use_is_one_line_and_exit_code_2(tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(main, ["verify", *arguments])
    assert result.exit_code == 2
    assert says in result.stderr
    assert result.stderr.count("\n") == 1
