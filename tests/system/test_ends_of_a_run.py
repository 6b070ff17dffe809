"""What ends a run from outside: a signal, a second one, a dead recorder, a full disk."""

import os
import resource
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from gateway.cycle.supervisor import State
from gateway.recordings.recording import read
from plant_emulator.emulator.process import EmulatorProcess
from tests.system.gateway_process import CONFIG, Gateway, gateway, until, until_armed

pytestmark = [pytest.mark.slow, pytest.mark.realtime]


def driving(emulator: EmulatorProcess, speed: float = 50.0) -> None:
    """In RUN; the driver has accelerated the motor to a speed [rad/s]."""
    until_armed(emulator)
    emulator.set_remote(on=True)
    until(lambda: emulator.status()["motor_speed"] > speed)


def recorder_of(daemon: Gateway) -> int:
    """Process that has the recording open."""
    number = daemon.process.pid
    children = Path(f"/proc/{number}/task/{number}/children").read_text().split()
    (found,) = [
        int(child)
        for child in children
        if any(str(one.resolve()).endswith(".rlrec") for one in Path(f"/proc/{child}/fd").iterdir())
    ]
    return found


def test_sighup_ramps_down_as_sigterm_does(tmp_path: Path) -> None:
    with EmulatorProcess(driver="pi") as emulator, gateway(tmp_path, emulator.port) as daemon:
        driving(emulator)
        assert daemon.stop(signal.SIGHUP) == 0
        assert emulator.status()["alarms"] == []
    assert daemon.passed()[-3:] == ["RAMPDOWN", "SAFE", "OFF"]


def test_second_sigterm_ends_at_once_and_the_plc_ramps_down(tmp_path: Path) -> None:
    """The ramp takes 2.4 s: 250 rad/s at 1000 rpm/s. It is enough for the braking of the truck."""
    slow = ("--set", "limits.rate_down_rpm_s=1000")
    with (
        EmulatorProcess(driver="pi") as emulator,
        gateway(tmp_path, emulator.port, *slow) as daemon,
    ):
        driving(emulator, 250.0)
        daemon.process.send_signal(signal.SIGTERM)
        daemon.runs_for(1.2)
        assert daemon.stop(signal.SIGTERM) == 1
        until(lambda: "COMMUNICATION" in emulator.status()["alarms"])
    assert "stopped at once by a second SIGTERM" in daemon.output
    assert daemon.passed()[-1] == "RAMPDOWN"
    records = read(next((tmp_path / "recordings").glob("*.rlrec"))).records
    assert records["tick"].tolist() == list(range(len(records)))


@pytest.mark.parametrize("end", ["killed", "full disk"])
def test_run_without_a_recorder_ramps_down_and_says_why(tmp_path: Path, end: str) -> None:
    """A limit of the size of files stands for a full disk."""
    with EmulatorProcess(driver="pi") as emulator, gateway(tmp_path, emulator.port) as daemon:
        driving(emulator)
        recorder = recorder_of(daemon)
        if end == "killed":
            os.kill(recorder, signal.SIGKILL)
        else:
            resource.prlimit(recorder, resource.RLIMIT_FSIZE, (1, 1))
        assert daemon.process.wait(30) == 1
        ended = emulator.status()
    assert (ended["speed_reference"], ended["alarms"]) == (0.0, [])
    why = "killed by SIGKILL" if end == "killed" else "File too large; expected room on the disk"
    assert f"the recorder failed: {why}" in daemon.output
    assert "Traceback" not in daemon.output
    records = read(next((tmp_path / "recordings").glob("*.rlrec"))).records
    assert records["tick"].tolist() == list(range(len(records)))
    assert len(records) > 100


def test_run_without_an_output_shows_nothing_and_ends_as_any_other(tmp_path: Path) -> None:
    """As `gateway run >&-`. Nobody listens at the port."""
    (tmp_path / "gateway.toml").write_text(CONFIG.format(port=1, map="bench_int16"))
    run = f"{sys.executable} -m gateway run -c gateway.toml --duration 0.2 >&-"
    done = subprocess.run(
        run, shell=True, cwd=tmp_path, stderr=subprocess.PIPE, timeout=60, check=False
    )
    assert (done.returncode, done.stderr) == (1, b"")


def test_reader_of_the_output_that_goes_away_ends_nothing(tmp_path: Path) -> None:
    """As `gateway run ... | head -1`: only the lines are lost."""
    with EmulatorProcess(driver="pi") as emulator:
        config = tmp_path / "gateway.toml"
        config.write_text(CONFIG.format(port=emulator.port, map="bench_int16"))
        command = [sys.executable, "-m", "gateway", "run", "-c", str(config), "--duration", "8"]
        with (
            (tmp_path / "errors.txt").open("wb") as errors,
            subprocess.Popen(
                command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=errors
            ) as process,
        ):
            assert process.stdout is not None
            assert b"start" in process.stdout.readline()
            process.stdout.close()
            driving(emulator)
            process.wait(20)
    assert (tmp_path / "errors.txt").read_text() == ""
    records = read(next((tmp_path / "recordings").glob("*.rlrec"))).records
    assert records["state"][-1] == State.OFF
    assert records["tick"].tolist() == list(range(len(records)))
