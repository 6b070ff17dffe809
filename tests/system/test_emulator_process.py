"""The emulator as a process: its first line, its control from outside and its end."""

import signal
import socket
import struct
import subprocess
import sys
import time

import pytest

from plant_emulator import logs
from plant_emulator.emulator.process import EmulatorProcess, ProcessError


def started(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "plant_emulator", "serve", "--port", "0", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for(state: str, emulator: EmulatorProcess, limit: float = 10.0) -> None:
    """Wait until the PLC is in that state."""
    end = time.monotonic() + limit
    while emulator.status()["state"] != state:
        assert time.monotonic() < end, f"never {state}"
        time.sleep(0.01)


@pytest.mark.slow
def test_stepped_emulator_stands_still_until_it_is_stepped():
    with EmulatorProcess(speed=None) as emulator:
        assert emulator.status()["time"] == 0.01
        emulator.step(99)
        assert emulator.status()["time"] == 1.0
        assert emulator.status()["time"] == 1.0
        assert len(emulator.log().time) == 100
    assert emulator.report == "100 scans"


@pytest.mark.slow
def test_switches_and_faults_are_turned_from_outside():
    with EmulatorProcess(speed=None) as emulator:
        emulator.set_remote(on=True)
        emulator.step(1)
        assert emulator.status()["remote"]
        emulator.open_interlocks("EMERGENCY_STOP")
        emulator.step(1)
        assert emulator.status()["state"] == "FAULT"
        with pytest.raises(ProcessError, match="unknown fault"):
            emulator.set_faults("gremlins")


@pytest.mark.slow
def test_control_ends_with_a_standard_input_that_no_loop_can_wait_for():
    """/dev/null, as a shell gives it to a program in the background."""
    command = [sys.executable, "-m", "plant_emulator", "serve", "--port", "0", "--control"]
    done = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, timeout=60, check=False
    )
    assert done.returncode == 0
    assert b"Traceback" not in done.stderr


def test_emulator_that_cannot_start_says_why():
    with pytest.raises(ProcessError, match="no_such_map"), EmulatorProcess(map="no_such_map"):
        pass


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "why"),
    [("no/run.csv", "No such file or directory"), ("run.xlsx", "no log format of that name")],
)
def test_log_that_could_not_be_written_is_refused_at_the_start(tmp_path, name, why):
    emulator = started("--duration", "600", "--log", str(tmp_path / name))
    out, err = emulator.communicate(timeout=60.0)
    assert (emulator.returncode, out) == (2, "")
    (line,) = err.splitlines()
    assert str(tmp_path / name) in line
    assert why in line
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.realtime
def test_real_time_is_held_and_reported():
    with EmulatorProcess(speed=10.0, truck_mass=None) as emulator:
        wait_for("READY", emulator)
        before, start = emulator.status()["time"], time.monotonic()
        time.sleep(0.5)
        emulated = emulator.status()["time"] - before
        elapsed = time.monotonic() - start
        assert emulated == pytest.approx(10.0 * elapsed, rel=0.1)
    assert "real-time factor 1.0" in emulator.report or "0.99" in emulator.report


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_it_cleanly_with_its_log_written(number, tmp_path):
    process = started("--log", str(tmp_path / "run.csv"))
    assert process.stdout is not None
    first = process.stdout.readline()
    assert first.startswith("listening on 127.0.0.1:")
    assert 0 < int(first.rpartition(":")[2]) < 65536
    time.sleep(0.2)
    process.send_signal(number)
    _, errors = process.communicate(timeout=10)
    assert process.returncode == 0
    assert "real-time factor" in errors
    assert len(logs.read(tmp_path / "run.csv").time) > 5


@pytest.mark.slow
def test_bad_clients_leave_no_bytes_on_the_terminal():
    """No Modbus, a protocol id, an unknown function, 126 registers, a reset in the middle."""
    process = started()
    assert process.stdout is not None
    address = ("127.0.0.1", int(process.stdout.readline().rpartition(":")[2]))
    for nonsense in (
        b"GET / HTTP/1.1",
        bytes(12),
        b"\0\1\0\0\0\2\1\x44",
        b"\0\1\0\0\0\6\1\3\0\0\0\x7e",
    ):
        with socket.create_connection(address, timeout=10) as wire:
            wire.sendall(nonsense)
            wire.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    with socket.create_connection(address, timeout=10) as wire:
        wire.sendall(b"\0\1\0\0\0\6\1\3\0\0\0\1")
        assert len(wire.recv(100)) == 11
    process.send_signal(signal.SIGTERM)
    out, errors = process.communicate(timeout=10)
    assert out == ""
    assert errors.count("\n") == 1
    assert "real-time factor" in errors


@pytest.mark.slow
def test_duration_is_in_emulated_seconds():
    process = started("--duration", "5", "--speed", "5")
    out, errors = process.communicate(timeout=30)
    assert process.returncode == 0
    assert out.count("\n") == 1
    assert 490 < int(errors.split()[0]) < 520


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["exception_4", "frozen_heartbeat"])
def test_a_fault_from_the_start_leaves_the_port_to_one_listener(fault):
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])
    process = started("--port", port, "--fault", fault, "--duration", "1")
    out, errors = process.communicate(timeout=60)
    assert (process.returncode, out) == (0, f"listening on 127.0.0.1:{port}\n"), errors


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["--map", "nowhere"], "nowhere"),
        (["--fault", "gremlins"], "gremlins"),
        (["--effect", "magic"], "magic"),
        (["--parameters", "nowhere"], "nowhere"),
        (["--truck", "light"], "light"),
        (["--speed", "0"], "--speed"),
        (["--port", "70000"], "--port"),
    ],
)
def test_wrong_usage_is_one_line_and_code_2(arguments, what):
    process = started(*arguments)
    out, errors = process.communicate(timeout=60)
    assert process.returncode == 2
    assert out == ""
    assert what in errors
    assert errors.count("\n") == 1
