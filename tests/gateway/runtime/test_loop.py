"""The clock of the gateway. Time is the test's; the PLC is the emulator, scanned as time passes."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import register_maps
from gateway.configuration.config import Config
from gateway.cycle.supervisor import State
from gateway.errors import BugError
from gateway.link.plc import LinkError, TcpLink
from gateway.offline import recording_replay
from gateway.reasons import Reason
from gateway.recordings import log, log_writer
from gateway.recordings.export import Export, Extent
from gateway.recordings.header import Header, config_of, map_of
from gateway.recordings.recording import GatewayRecording, read, stream
from gateway.runtime.loop import Loop
from plant_emulator.emulator.process import EmulatorProcess
from register_maps.register_map import RegisterMap

pytestmark = pytest.mark.slow

MAP = register_maps.load("bench_int16")
SCAN = 0.01


class Bench:
    """An emulator and a clock that belong together: waiting lets the PLC scan."""

    def __init__(self, emulator: EmulatorProcess) -> None:
        self.emulator = emulator
        self.time = 1000.0
        self.scanned = 1000.0
        self.late = 0.0

    def now(self) -> float:
        return self.time

    def sleep_until(self, deadline: float) -> None:
        self.time = max(self.time, deadline) + self.late
        if scans := int((self.time - self.scanned) / SCAN + 0.5):
            self.emulator.step(scans)
            self.scanned += scans * SCAN


class Sink:
    """Keeps the records of a run as the recorder's file would."""

    dropped = 0
    failed = False

    def __init__(self, config: Config, path: Path) -> None:
        self.path = path
        made_with = Header.of(config, MAP, started=1000.0, shadow=False, real_time="no")
        path.write_bytes(made_with.encode())

    def push(self, record: bytes) -> None:
        with self.path.open("ab") as file:
            file.write(record)


class Run:
    """A loop on a bench that is stepped tick by tick."""

    def __init__(
        self,
        emulator: EmulatorProcess,
        path: Path,
        *,
        shadow: bool = False,
        register_map: RegisterMap = MAP,
    ) -> None:
        self.bench = Bench(emulator)
        self.config = Config().with_values({"plc.port": str(emulator.port)})
        self.sink = Sink(self.config, path)
        self.link = TcpLink("127.0.0.1", emulator.port, unit=1, timeout=1.0)
        self.ticks = 0
        self.loop = Loop(
            config=self.config,
            register_map=register_map,
            link=self.link,
            sink=self.sink,
            clock=self.bench,
            shadow=shadow,
        )

    def for_ticks(self, count: int) -> "Run":
        """Go on, without a stop being asked for."""
        for _ in range(count):
            deadline = 1000.0 + self.ticks * 0.01
            self.bench.sleep_until(deadline)
            self.output = self.loop.tick(deadline, stop_requested=False)
            self.ticks += 1
        return self

    def into(self, state: State, within: int) -> int:
        """Go on until the state is reached; ticks that it took."""
        for taken in range(within):
            if self.for_ticks(1).output.state is state:
                return taken + 1
        raise AssertionError(f"{self.output.state.name} {self.output.reason} after {within} ticks")

    @property
    def recording(self) -> GatewayRecording:
        return read(self.sink.path)


@pytest.fixture
def emulator() -> Iterator[EmulatorProcess]:
    with EmulatorProcess(speed=None, driver="none", truck_mass=3640.0) as running:
        yield running


@pytest.fixture
def run(emulator: EmulatorProcess, tmp_path: Path) -> Iterator[Run]:
    made = Run(emulator, tmp_path / "run.rlrec")
    yield made
    made.link.close()


def running(run: Run) -> Run:
    """In RUN, the way an operator gets there, and the truck drives: it starts after 2 s."""
    run.into(State.ARMED, 100)
    run.bench.emulator.set_remote(on=True)
    run.into(State.RUN, 20)
    run.for_ticks(300)
    assert run.bench.emulator.status()["motor_speed"] > 10.0
    return run


def test_the_way_to_run_is_connect_shadow_armed_remote(run: Run) -> None:
    running(run)
    states = [State(state) for state in run.recording.records["state"]]
    order = list(dict.fromkeys(states))
    assert order == [State.CONNECT, State.SHADOW, State.ARMED, State.RUN]


def test_a_stop_ramps_down_and_ends_with_the_connection_closed(run: Run) -> None:
    running(run)
    run.loop.run(lambda: True)
    states = [State(state) for state in run.recording.records["state"]]
    assert list(dict.fromkeys(states))[-3:] == [State.RAMPDOWN, State.SAFE, State.OFF]
    with pytest.raises(LinkError):
        run.link.read(0, 1)


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("frozen_heartbeat", Reason.HEARTBEAT_FROZEN),
        ("exception_4", Reason.EXCEPTION_4),
        ("wrong_function", Reason.WRONG_FUNCTION),
        ("wrong_count", Reason.WRONG_COUNT),
    ],
)
def test_a_lying_plc_ends_the_run_within_150_ms(run: Run, fault: str, reason: Reason) -> None:
    running(run)
    run.bench.emulator.set_faults(fault)
    assert run.into(State.RAMPDOWN, 15) <= 15
    assert run.output.reason is reason


def test_a_setpoint_that_the_map_cannot_hold_is_ramped_down_from(
    emulator: EmulatorProcess, tmp_path: Path
) -> None:
    """The register ends at 200 rpm; the truck goes on to 3604 rpm."""
    narrow = [
        replace(one, range=(0.0, 200.0)) if one.signal == "speed_setpoint" else one
        for one in MAP.registers
    ]
    run = Run(
        emulator,
        tmp_path / "run.rlrec",
        register_map=replace(MAP, registers=tuple(narrow)),
    )
    run.into(State.ARMED, 100)
    emulator.set_remote(on=True)
    run.into(State.RUN, 20)
    run.into(State.RAMPDOWN, 600)
    assert run.output.reason is Reason.NOT_ENCODABLE
    assert 15.0 < emulator.status()["speed_reference"] < 21.5
    run.into(State.SAFE, 50)
    run.for_ticks(10)
    assert emulator.status()["speed_reference"] == 0.0
    run.link.close()


class Refusing(TcpLink):
    """A link whose writes fail, and from then on every second reading."""

    refuses, reads = False, 0

    def read(self, address: int, count: int, function: int = 3) -> tuple[int, ...]:
        self.reads += 1
        if self.refuses and self.reads % 2:
            raise LinkError(Reason.TIMEOUT, "no reply in time")
        return super().read(address, count, function)

    def write(self, address: int, words: Sequence[int]) -> None:
        if self.refuses:
            raise LinkError(Reason.EXCEPTION_2, "exception 2")
        super().write(address, words)


def test_fault_of_a_write_is_not_forgotten_over_a_tick_without_a_reading(run: Run) -> None:
    link = Refusing("127.0.0.1", run.bench.emulator.port, unit=1, timeout=1.0)
    run.link = run.loop._link = link
    running(run)
    link.refuses = True
    assert run.into(State.RAMPDOWN, 15) <= 15
    assert run.output.reason is Reason.EXCEPTION_2


class Delaying(TcpLink):
    """A link that stands still before a write or after a reading, while the PLC scans on."""

    bench: Bench
    stops_at, stop = "", 0.0

    def read(self, address: int, count: int, function: int = 3) -> tuple[int, ...]:
        words = super().read(address, count, function)
        self._wait("after the reading")
        return words

    def write(self, address: int, words: Sequence[int]) -> None:
        self._wait("before the write")
        super().write(address, words)
        self._wait("after the write")

    def _wait(self, place: str) -> None:
        if place == self.stops_at:
            self.stops_at = ""
            self.bench.sleep_until(self.bench.time + self.stop)


@pytest.mark.parametrize(
    ("place", "stop"),
    [("after the reading", 0.09), ("before the write", 0.13), ("after the write", 0.13)],
)
def test_gateway_that_stood_still_takes_its_own_command_for_no_others(
    run: Run, place: str, stop: float
) -> None:
    """As on a busy computer. Stale data end a run after 0.1 s, the watchdog after 0.2 s."""
    link = Delaying("127.0.0.1", run.bench.emulator.port, unit=1, timeout=1.0)
    link.bench, link.stop = run.bench, stop
    run.link = run.loop._link = link
    running(run)
    link.stops_at = place
    reasons = set()
    for _ in range(30):
        reasons.add(run.for_ticks(1).output.reason)
        run.ticks = max(run.ticks, round((run.bench.time - 1000.0) / SCAN) + 1)
    assert link.stops_at == ""
    assert reasons == {None}


def test_shadow_writes_nothing(emulator: EmulatorProcess, tmp_path: Path) -> None:
    run = Run(emulator, tmp_path / "run.rlrec", shadow=True)
    emulator.set_remote(on=True)
    run.for_ticks(100)
    records = run.recording.records
    assert not records["setpoint_speed_setpoint"][records["flags"] & 8 > 0].size
    assert records["measured_command_sequence_echo"].max() == 0
    run.link.close()


def test_a_late_tick_skips_deadlines_and_keeps_phase(run: Run) -> None:
    run.bench.late = 0.0
    deadline = run.bench.now()
    run.loop.tick(deadline, stop_requested=False)
    run.bench.time = deadline + 0.034
    assert run.loop._next(deadline) == pytest.approx(deadline + 0.04)
    assert run.loop.missed == 3


def test_an_error_of_ours_ends_the_run_and_the_connection(run: Run) -> None:
    running(run)
    run.sink.push = lambda _: 1 / 0  # type: ignore[assignment]
    with pytest.raises(BugError, match="ZeroDivisionError"):
        run.loop.run(lambda: False)
    with pytest.raises(LinkError):
        run.link.read(0, 1)


def test_a_replay_is_equal_bit_for_bit(run: Run) -> None:
    running(run)
    run.loop.run(lambda: True)
    recorded = run.recording
    again = map_of(recorded.header)
    config = config_of(recorded.header)
    outputs = list(
        recording_replay.outputs(
            config, again, recording_replay.observations(recorded.rows(), again)
        )
    )
    assert len(outputs) == len(recorded) > 320
    assert list(recording_replay.differences(recorded.rows(), outputs, again)) == []
    other = config.with_values({"truck.mass_kg": "5240"})
    outputs = list(
        recording_replay.outputs(
            other, again, recording_replay.observations(recorded.rows(), again)
        )
    )
    assert list(recording_replay.differences(recorded.rows(), outputs, again)) != []


def test_an_exported_recording_is_a_log(run: Run, tmp_path: Path) -> None:
    running(run)
    path = tmp_path / "run.csv"
    log_writer.write(path, Export(stream(run.sink.path), Extent()))
    exported = log.read(path)
    assert exported.time[0] == 0.0
    assert np.diff(exported.time) == pytest.approx(0.01)
    measured = run.recording.records["measured_motor_speed"]
    assert exported.columns["motor_speed"].tolist() == measured[np.isfinite(measured)].tolist()
