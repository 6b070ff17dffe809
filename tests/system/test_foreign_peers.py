"""Programs that are not ours as clients, PLC and referee: mbpoll, libmodbus in C, tshark."""

import os
import subprocess
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import pytest

from plant_emulator.emulator.process import EmulatorProcess
from register_maps import load
from register_maps.codec import decode_measurement, decode_setpoint
from tests.conftest import missing
from tests.system.gateway_process import gateway, until, until_armed

pytestmark = [pytest.mark.peer, pytest.mark.slow]

INT16 = load("bench_int16")
C_SOURCE = Path(__file__).with_name("libmodbus_plc.c")


class Mbpoll:
    """mbpoll against one port: zero-based addresses, unit 1, one poll."""

    def __init__(self, program: str, port: int) -> None:
        self.command = [program, "-q", "-1", "-0", "-a", "1", "-p", str(port)]

    def run(self, *arguments: str, values: tuple[float, ...] = ()) -> subprocess.CompletedProcess:
        words = [str(value) for value in values]
        return subprocess.run(
            [*self.command, *arguments, "127.0.0.1", *words],
            capture_output=True,
            text=True,
            timeout=20,
            check=False,
        )

    def read(self, address: int, count: int = 1, *, kind: str = "4") -> list[str]:
        """Values as mbpoll prints them."""
        kind, *order = kind.split()
        answer = self.run("-r", str(address), "-c", str(count), "-t", kind, *order)
        assert answer.returncode == 0, answer.stderr
        lines = [line for line in answer.stdout.splitlines() if line.startswith("[")]
        return [line.split("\t")[1].split()[0] for line in lines]


@pytest.fixture
def mbpoll(require_program) -> Callable[[int], Mbpoll]:
    program = require_program("mbpoll")
    return lambda port: Mbpoll(program, port)


def test_mbpoll_reads_the_words_that_the_int16_map_says(mbpoll):
    with EmulatorProcess(speed=None, remote=True) as emulator:
        emulator.step(41)
        read = [int(word) for word in mbpoll(emulator.port).read(0, 32)]
    measurement = decode_measurement(INT16, read)
    # 42 scans of 10 ms; a cold start at 32 degC; the constants as the map has them
    assert (measurement.sequence_start, measurement.sequence_end) == (42, 42)
    assert measurement.plc_time == pytest.approx(0.42)
    assert measurement.shell_temperature_1 == pytest.approx(305.15)
    assert (measurement.test_int16, measurement.test_uint32) == (-12345, 0x12345678)


def test_mbpoll_sees_the_word_order_of_the_int16_map_proven(mbpoll):
    with EmulatorProcess(speed=None) as emulator:
        poll = mbpoll(emulator.port)
        assert poll.read(29, kind="4:int -B") == [str(0x12345678)]
        assert poll.read(29, kind="4:int") == [str(0x56781234)]
        assert poll.read(29, kind="3:int -B") == [str(0x12345678)]


def test_mbpoll_reads_the_floats_of_the_float32_map(mbpoll):
    with EmulatorProcess(speed=None, map="bench_float32") as emulator:
        poll = mbpoll(emulator.port)
        assert poll.read(138, kind="4:float -B") == ["123.456"]
        assert poll.read(138, 2, kind="4:hex") == ["0x42F6", "0xE979"]
        assert poll.read(122, 2, kind="4:float -B") == ["32", "32"]


def test_mbpoll_writes_the_command_block_and_the_plc_acts(mbpoll):
    # CMD_SEQ HB CTRL MODE 1000 rpm RATE 1000 rpm/s 72 A 200 ms version CRC reserved
    first = (1, 1, 0, 3, 0, 0, 1000, 7200, 200, 1, 0, 0, 0, 0, 0, 0)
    enable = (2, 2, 1, 3, 5000, 0, 1000, 7200, 200, 1, 0, 0, 0, 0, 0, 0)
    with EmulatorProcess(speed=None, remote=True, truck_mass=None) as emulator:
        poll = mbpoll(emulator.port)
        for block in (first, enable):
            assert poll.run("-r", "64", "-t", "4", values=block).returncode == 0
            emulator.step(1)
        assert emulator.status()["state"] == "SPEED"
        assert poll.read(24) == ["2"]
        assert poll.read(64, 16) == [str(word) for word in enable]
        emulator.step(10)
        # 11 scans along 1000 rpm/s: 110 rpm, shown in 0.2 rpm
        assert poll.read(14) == ["550"]


def test_float_that_mbpoll_writes_is_the_setpoint_that_the_map_decodes(mbpoll):
    with EmulatorProcess(speed=None, map="bench_float32") as emulator:
        poll = mbpoll(emulator.port)
        # MODE, watchdog and map version, then reference and slope, as the map has them
        poll.run("-r", "195", "-t", "4", values=(4,))
        poll.run("-r", "196", "-t", "4:float", "-B", values=(104.71976, 12.5))
        read = [int(word) for word in poll.read(192, 32)]
    setpoint = decode_setpoint(load("bench_float32"), read)
    assert setpoint.speed_setpoint == pytest.approx(104.71976)
    assert setpoint.speed_rate == 12.5


def test_mbpoll_cannot_write_a_measurement(mbpoll):
    with EmulatorProcess(speed=None) as emulator:
        answer = mbpoll(emulator.port).run("-r", "8", "-t", "4", values=(1,))
    assert answer.returncode != 0
    assert "Illegal data address" in answer.stderr


@pytest.fixture
def libmodbus_plc(require_program, tmp_path) -> Path:
    """The C program, compiled."""
    compiler, pkg_config = require_program("gcc"), require_program("pkg-config")
    flags = subprocess.run(
        [pkg_config, "--cflags", "--libs", "libmodbus"], capture_output=True, text=True, check=False
    )
    if flags.returncode != 0:
        missing("libmodbus (development files) is not installed")
    program = tmp_path / "libmodbus_plc"
    subprocess.run(
        [compiler, "-O2", "-o", program, C_SOURCE, *flags.stdout.split(), "-lm"], check=True
    )
    return program


@contextmanager
def c_plc(program: Path, remote_after: float) -> Iterator[tuple[int, subprocess.Popen[str]]]:
    """Run it; its port and process."""
    process = subprocess.Popen([program, str(remote_after)], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        yield int(process.stdout.readline().rpartition(":")[2]), process
    finally:
        process.terminate()
        process.communicate(timeout=10)


@pytest.mark.realtime
def test_plc_made_with_libmodbus_is_controlled_into_run(libmodbus_plc, tmp_path):
    with (
        c_plc(libmodbus_plc, remote_after=3.0) as (port, process),
        gateway(tmp_path, port) as daemon,
    ):
        # the operator's switch comes at 3 s; then 3 s of a truck that pushes
        daemon.runs_for(7.0)
        assert daemon.stop() == 0, daemon.output
        process.terminate()
        said, _ = process.communicate(timeout=10)
    words = said.split()
    seen = dict(zip(words[::2], map(float, words[1::2]), strict=True))
    assert seen["enabled_scans"] > 200
    assert seen["speed_max"] > 100.0
    assert daemon.passed()[:4] == ["CONNECT", "SHADOW", "ARMED", "RUN"]


class Capture:
    """tshark listening on the loopback; afterwards, its dissection of what passed one port."""

    def __init__(self, program: str, folder: Path, port: int) -> None:
        self.program, self.port = program, port
        self.file = folder / "capture.pcapng"
        # -l and one line on standard error when it listens: "Capturing on 'Loopback: lo'"
        self.process = subprocess.Popen(
            [program, "-i", "lo", "-f", f"tcp port {port}", "-w", self.file],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stderr is not None
        while "Capturing on" not in (line := self.process.stderr.readline()):
            if not line:
                missing("tshark may not capture here (needs root)")
        until(self.file.exists)

    def stop(self) -> None:
        self.process.terminate()
        self.process.communicate(timeout=20)

    def requests(self) -> list[int]:
        """Function code of each request, in order."""
        dissected = subprocess.run(
            [
                *(self.program, "-r", self.file, "-o", f"mbtcp.tcp.port:{self.port}"),
                *("-Y", f"modbus && tcp.dstport == {self.port}"),
                *("-T", "fields", "-e", "modbus.func_code"),
            ],
            capture_output=True,
            text=True,
            check=True,
        )
        return [int(code) for line in dissected.stdout.split() for code in line.split(",")]


@contextmanager
def captured(program: str, folder: Path, port: int) -> Iterator[Capture]:
    capture = Capture(program, folder, port)
    try:
        yield capture
    finally:
        capture.stop()


@pytest.fixture
def tshark(require_program) -> str:
    if os.geteuid() != 0:
        missing("tshark may not capture here (needs root)")
    return require_program("tshark")


@pytest.mark.realtime
def test_tshark_sees_one_read_and_one_write_a_tick_in_run(tshark, tmp_path):
    with EmulatorProcess(driver="pi") as emulator, gateway(tmp_path, emulator.port) as daemon:
        until_armed(emulator)
        emulator.set_remote(on=True)
        until(lambda: emulator.status()["state"] == "ROAD_LOAD")
        with captured(tshark, tmp_path, emulator.port) as capture:
            daemon.runs_for(2.0)
        assert daemon.stop() == 0, daemon.output
    requests = capture.requests()
    assert set(requests) == {3, 16}
    # whatever the capture cut at its ends: read and write alternate without an exception
    assert all(a != b for a, b in pairwise(requests))
    # 2 s at 100 Hz, less what a busy machine missed
    assert Counter(requests)[3] > 150


@pytest.mark.realtime
def test_tshark_sees_not_one_write_in_shadow(tshark, tmp_path):
    with (
        EmulatorProcess() as emulator,
        captured(tshark, tmp_path, emulator.port) as capture,
        gateway(tmp_path, emulator.port, "--shadow") as daemon,
    ):
        emulator.set_remote(on=True)
        until(lambda: "SHADOW" in daemon.output)  # a busy machine takes seconds to start it
        daemon.runs_for(2.0)
        assert daemon.stop() == 0, daemon.output
    requests = capture.requests()
    assert Counter(requests)[3] > 100
    assert set(requests) == {3}
