"""`gateway drive`: on the emulated bench over the socket, and what is refused before the start."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from gateway.cli import main
from plant_emulator import logs
from plant_emulator.emulator.process import EmulatorProcess
from tests.system.gateway_process import until, until_armed

PROGRAM = "time_s,speed_rpm,dwell_s\n0,0,0.2\n1.5,450,0.8\n3,0,0\n"


def started(folder: Path, port: int) -> "subprocess.Popen[str]":
    (folder / "bench.toml").write_text(f'[plc]\nport = {port}\n[recording]\ndir = "unused"\n')
    (folder / "short.csv").write_text(PROGRAM)
    command = ["drive", "short.csv", "-c", "bench.toml", "--out", "runs", "--json", "drive.json"]
    return subprocess.Popen(
        [sys.executable, "-m", "gateway", *command],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.slow
@pytest.mark.realtime
def test_a_program_leaves_a_recording_and_a_log_with_the_reference_that_was_asked_for(tmp_path):
    with EmulatorProcess(truck_mass=None) as emulator:
        process = started(tmp_path, emulator.port)
        until_armed(emulator)
        emulator.set_remote(on=True)
        output, errors = process.communicate(timeout=60)
        until(lambda: emulator.status()["state"] == "READY")
    assert process.returncode == 0, errors
    assert "no truck on the drum; short.csv takes 4 s" in errors
    told = json.loads((tmp_path / "drive.json").read_text())
    assert told["schema"] == "drive/1"
    assert told["completed"]
    assert told["duration_s"] == pytest.approx(4.0)
    assert f"log: {told['log']}" in output
    log = logs.read(tmp_path / told["log"])
    reference = log["speed_reference"]
    assert reference.max() == pytest.approx(450.0 * 2.0 * np.pi / 60.0, abs=0.05)
    assert np.ptp(log.time[reference > 47.1]) == pytest.approx(0.8, abs=0.2)
    assert not reference[:10].any()
    assert np.abs(log["motor_speed"][:10]).max() < 0.5


@pytest.mark.slow
@pytest.mark.realtime
def test_ctrl_c_ramps_down_and_still_leaves_the_log(tmp_path):
    with EmulatorProcess(truck_mass=None) as emulator:
        process = started(tmp_path, emulator.port)
        until_armed(emulator)
        emulator.set_remote(on=True)
        until(lambda: emulator.status()["motor_speed"] > 5.0)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        until(lambda: emulator.status()["state"] == "READY")
        assert abs(emulator.status()["motor_speed"]) < 1.0
    assert process.returncode == 1
    assert "short.csv did not come to its end: stopped by the operator" in errors
    told = json.loads((tmp_path / "drive.json").read_text())
    assert not told["completed"]
    assert logs.read(tmp_path / told["log"])["motor_speed"].max() > 5.0


@pytest.mark.slow
@pytest.mark.realtime
def test_a_run_that_did_not_begin_leaves_no_log(tmp_path):
    """Its log would be one more file of runs/*.csv.gz, in which nothing moves."""
    with EmulatorProcess(truck_mass=None) as emulator:
        process = started(tmp_path, emulator.port)
        until_armed(emulator)
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "short.csv did not come to its end: stopped by the operator" in errors
    assert "log:" not in output
    assert json.loads((tmp_path / "drive.json").read_text())["log"] is None
    assert not list((tmp_path / "runs").glob("*.csv.gz"))


@pytest.mark.parametrize(
    ("program", "says"),
    [
        ("program4", "program4: 46.00 s: the limits would clip the slope"),
        ("program9", "expected a CSV file, or one of program1, program2, program3, program4"),
        ("steps.csv", "steps.csv: no program, found 'a,b'"),
    ],
)
def test_what_cannot_be_driven_is_one_line_before_the_start(tmp_path, monkeypatch, program, says):
    monkeypatch.chdir(tmp_path)
    Path("bench.toml").write_text("[plc]\nport = 1\n")
    Path("steps.csv").write_text("a,b\n")
    result = CliRunner().invoke(main, ["drive", program, "-c", "bench.toml"])
    assert result.exit_code == 2
    assert says in result.stderr
    assert result.stderr.count("\n") == 1
