"""`gateway run` as an operator meets it: a process, its output, its exit code, its recording."""

import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gateway.cycle.cycle import Output
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from gateway.recordings.recording import GatewayRecording, read
from gateway.runtime.daemon import fault_of
from plant_emulator.emulator.process import EmulatorProcess

pytestmark = [pytest.mark.slow, pytest.mark.realtime]


@pytest.fixture
def emulator() -> Iterator[EmulatorProcess]:
    with EmulatorProcess(driver="none", truck_mass=3640.0) as running:
        yield running


class Gateway:
    """The daemon as a process, against a port."""

    def __init__(self, directory: Path, port: int, *options: str) -> None:
        self.recordings = directory / "recordings"
        config = directory / "gateway.toml"
        config.write_text(f'[plc]\nport = {port}\n[recording]\ndir = "{self.recordings}"\n')
        self.process = subprocess.Popen(
            [sys.executable, "-m", "gateway", "run", "-c", config, *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=Path(__file__).parents[3],
        )

    def ended(self) -> tuple[int, str]:
        """Exit code and output."""
        output, _ = self.process.communicate(timeout=60)
        return self.process.returncode, output

    @property
    def recording(self) -> GatewayRecording:
        (path,) = self.recordings.glob("*.rlrec")
        return read(path)

    def states(self) -> list[str]:
        """The states of the recording, each stretch once; none before its header is written."""
        if not any(path.stat().st_size for path in self.recordings.glob("*.rlrec")):
            return []
        found = self.recording
        names = [found.state(state) for state in found.records["state"]]
        return [name for name, before in zip(names, ["", *names], strict=False) if name != before]


def until(holds: Callable[[], bool], seconds: float = 20.0) -> None:
    deadline = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def driving(emulator: EmulatorProcess, gateway: Gateway) -> None:
    """In RUN, and the truck has set off."""
    until(lambda: gateway.recordings.exists() and "ARMED" in gateway.states())
    emulator.set_remote(on=True)
    until(lambda: emulator.status()["motor_speed"] > 50.0)


def test_sigterm_ramps_down_and_keeps_the_recording(
    emulator: EmulatorProcess, tmp_path: Path
) -> None:
    gateway = Gateway(tmp_path, emulator.port)
    driving(emulator, gateway)
    gateway.process.send_signal(signal.SIGTERM)
    code, output = gateway.ended()
    assert code == 0, output
    assert gateway.states() == ["CONNECT", "SHADOW", "ARMED", "RUN", "RAMPDOWN", "SAFE", "OFF"]
    assert "RAMPDOWN   STOP_REQUESTED" in output
    assert "ended by the operator" in output
    assert emulator.status()["speed_reference"] == pytest.approx(0.0, abs=1.0)


def test_sigkill_leaves_a_whole_recording_and_a_drum_that_is_ramped_down(
    emulator: EmulatorProcess, tmp_path: Path
) -> None:
    gateway = Gateway(tmp_path, emulator.port)
    driving(emulator, gateway)
    gateway.process.kill()
    killed = emulator.status()
    # watchdog 0.2 s, then 3000 rpm/s = 314 rad/s^2, and a scan or two
    ramp = 0.2 + killed["speed_reference"] / 314.0 + 0.1
    until(lambda: emulator.status()["speed_reference"] == 0.0)
    assert emulator.status()["time"] - killed["time"] < ramp + 0.1  # as often as `until` looks
    assert gateway.ended()[0] == -signal.SIGKILL  # the output ends when the recorder does
    found = gateway.recording
    assert found.state(found.records["state"][-1]) == "RUN"
    assert found.records["measured_plc_time"][-1] == pytest.approx(killed["time"], abs=0.1)


def test_a_plc_that_is_gone_is_the_reason_and_exit_code_1(
    emulator: EmulatorProcess, tmp_path: Path
) -> None:
    gateway = Gateway(tmp_path, emulator.port)
    driving(emulator, gateway)
    emulator.stop()
    until(lambda: "SAFE" in gateway.states())
    gateway.process.send_signal(signal.SIGINT)
    code, output = gateway.ended()
    assert code == 1
    assert "RAMPDOWN   CONNECTION_LOST" in output or "RAMPDOWN   NOT_CONNECTED" in output
    assert "Traceback" not in output


def test_nobody_there_is_exit_code_1_and_says_so(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    code, output = Gateway(tmp_path, port, "--duration", "0.3").ended()
    assert code == 1
    assert "NOT_CONNECTED" in output


def test_shadow_sends_no_command(emulator: EmulatorProcess, tmp_path: Path) -> None:
    emulator.set_remote(on=True)
    gateway = Gateway(tmp_path, emulator.port, "--shadow", "--duration", "1.0")
    code, output = gateway.ended()
    assert code == 0, output
    assert gateway.states() == ["CONNECT", "SHADOW", "OFF"]
    last = gateway.recording.records[-2]
    assert (last["measured_command_sequence_echo"], last["measured_command_age"]) == (0, 65.535)
    assert last["demand"] == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("[plc]\nprt = 5020\n", "prt"),
        ("[plc]\nport = 70000\n", "70000"),
        ('[plc]\nmap = "no_such_map"\n', "no_such_map"),
        ('[plc]\nhost = "no such host"\n', "no such host"),
    ],
)
def test_a_bad_configuration_is_one_line_and_exit_code_2(
    tmp_path: Path, line: str, says: str
) -> None:
    config = tmp_path / "bad.toml"
    config.write_text(line)
    ended = subprocess.run(
        [sys.executable, "-m", "gateway", "run", "-c", config],
        capture_output=True,
        text=True,
        cwd=Path(__file__).parents[3],
        check=False,
    )
    assert ended.returncode == 2
    assert says in ended.stderr
    assert ended.stderr.count("\n") == 1


LIGHT = "[truck]\nmass_kg = 300\n[plc]\nport = 1\n"


def run_with(tmp_path: Path, text: str, *options: str) -> subprocess.CompletedProcess[str]:
    (tmp_path / "bench.toml").write_text(text)
    return subprocess.run(
        [sys.executable, "-m", "gateway", "run", "-c", "bench.toml", *options],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
        timeout=60,
    )


def test_what_check_refuses_is_not_run_one_line_a_finding(tmp_path: Path) -> None:
    """rho = 312.71 / (300 x 0.645^2) = 2.5056; 60 ms are over half of 100 ms."""
    ended = run_with(tmp_path, LIGHT, "--set", "loop.period_ms=60")
    first, second = ended.stderr.splitlines()
    assert ended.returncode == 2
    assert "rho" in first
    assert "found 2.5056" in first
    assert "loop.period_ms" in second
    told = "see gateway check -c bench.toml --set loop.period_ms=60"
    assert first.endswith(told)
    assert second.endswith(told)
    assert not (tmp_path / "recordings").exists()


def test_shadow_only_warns_of_what_check_refuses(tmp_path: Path) -> None:
    ended = run_with(tmp_path, LIGHT, "--shadow", "--duration", "0.3")
    assert "warning: bench.toml: truck.mass_kg" in ended.stderr
    assert "error:" not in ended.stderr
    assert list((tmp_path / "recordings").glob("*.rlrec"))


@pytest.mark.parametrize(
    ("state", "reason", "fault"),
    [
        (State.CONNECT, Reason.NOT_CONNECTED, Reason.NOT_CONNECTED),
        (State.SHADOW, Reason.PLC_NOT_READY, None),
        (State.ARMED, None, None),
        (State.ARMED, Reason.EXCEPTION_4, Reason.EXCEPTION_4),
        (State.RUN, None, None),
        (State.RAMPDOWN, Reason.TIMEOUT, Reason.TIMEOUT),
        (State.SAFE, Reason.OTHER_MASTER, Reason.OTHER_MASTER),
        (State.SAFE, Reason.REMOTE_OFF, None),
        (State.SAFE, Reason.STOP_REQUESTED, None),
    ],
)
def test_the_end_is_the_peers_fault_unless_the_operator_wished_it(
    state: State, reason: Reason | None, fault: Reason | None
) -> None:
    """In ARMED a reason says that no write gets through."""
    before = Output(setpoint=None, demand=None, state=state, reason=reason, age=None)
    assert fault_of(before) is fault


def test_a_stop_before_the_first_tick_is_nobodys_fault() -> None:
    assert fault_of(None) is None


@pytest.mark.parametrize("name", ["../thesis", "", "window", "thesis.py"])
@pytest.mark.parametrize("command", ["run", "check"])
def test_a_regulator_that_there_is_not_is_one_line_and_exit_code_2(
    tmp_path: Path, name: str, command: str
) -> None:
    (tmp_path / "bench.toml").write_text(f'[regulator]\nname = "{name}"\n')
    ended = subprocess.run(
        [sys.executable, "-m", "gateway", command, "-c", "bench.toml"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
        timeout=60,
    )
    assert ended.returncode == 2
    assert ended.stderr.count("\n") == 1
    why = "unknown regulator" if name else "empty"
    assert f"bench.toml:2: [regulator] name: {why}" in ended.stderr
    assert not name or "compensated or learned or thesis" in ended.stderr
