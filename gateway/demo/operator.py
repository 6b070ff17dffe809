"""The operator of the demo: waits for ARMED, sets remote at the PLC, clears it after the cycle.

In real time the gateway is the daemon (`gateway run`) in a process of its own, and the operator
only reads its recording. In a fast demo the same loop runs in this process over the same kind of
socket. The emulator then scans on request, so that nothing waits for a clock.
"""

import math
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

import numpy as np

import register_maps
from gateway.configuration.config import Config
from gateway.cycle.supervisor import State
from gateway.demo.view import Moment, Screen
from gateway.errors import GatewayError
from gateway.link.plc import TcpLink
from gateway.recordings import recording
from gateway.recordings.header import Header
from gateway.recordings.parts import SUFFIX
from gateway.runtime.loop import Loop
from register_maps.timing import SCAN

LOOK_EVERY: Final = 0.1
CHANGE_WITHIN: Final = 30.0
"""[s] Longest wait for each state, besides the cycle itself."""


class EmulatorSwitches(Protocol):
    """Switches of the emulated bench."""

    def set_remote(self, *, on: bool) -> None:
        """Turn the operator's switch."""

    def step(self, scans: int) -> None:
        """Run so many scans."""


@dataclass(frozen=True, kw_only=True)
class Session:
    """One run to operate: configuration and its file, bench, screen, duration of the cycle [s]."""

    config: Config
    file: Path
    emulator: EmulatorSwitches
    screen: Screen
    duration: float


@dataclass(frozen=True, kw_only=True)
class GatewayRun:
    """Result of one gateway: its recording and its exit code."""

    recording: Path
    exit_code: int


def operate_in_real_time(session: Session) -> GatewayRun:
    """Run the daemon through one cycle in real time. Raises GatewayError."""
    folder, words = session.file.parent, session.file.with_suffix(".txt")
    before = set(folder.glob(f"*{SUFFIX}"))
    with (
        words.open("w", encoding="utf-8") as said,
        subprocess.Popen(
            [sys.executable, "-m", "gateway", "run", "-c", str(session.file)],
            stdout=said,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
        ) as daemon,
    ):
        try:
            wait_for("a recording", lambda: bool(set(folder.glob(f"*{SUFFIX}")) - before), daemon)
            (path,) = set(folder.glob(f"*{SUFFIX}")) - before
            _operate(session, Follower(path, session), daemon)
        except GatewayError as error:
            raise GatewayError(f"{error}; the daemon's words: {words}") from error
        finally:
            daemon.send_signal(signal.SIGTERM)
    return GatewayRun(recording=path, exit_code=daemon.returncode)


def _operate(session: Session, look: "Follower", daemon: "subprocess.Popen[bytes]") -> None:
    wait_for("ARMED", lambda: look.state() is State.ARMED, daemon)
    session.emulator.set_remote(on=True)
    wait_for("RUN", lambda: look.state() is State.RUN, daemon)
    over = CHANGE_WITHIN + session.duration
    wait_for(
        "the end of the cycle",
        lambda: look.state() is not State.RUN or look.time > session.duration,
        daemon,
        over,
    )
    session.emulator.set_remote(on=False)
    wait_for("SAFE", lambda: look.state() is State.SAFE, daemon)


def wait_for(
    what: str,
    holds: Callable[[], bool],
    daemon: "subprocess.Popen[bytes]",
    within: float = CHANGE_WITHIN,
) -> None:
    """Wait until a condition holds. Raises GatewayError after `within` [s] or a daemon's end."""
    deadline = time.monotonic() + within
    while not holds():
        if daemon.poll() is not None:
            raise GatewayError(f"the daemon ended before {what}, exit code {daemon.returncode}")
        if time.monotonic() > deadline:
            raise GatewayError(f"the gateway did not come to {what} within {within:g} s")
        time.sleep(LOOK_EVERY)


class Follower:
    """Reads the growing recording of the daemon, and shows its newest tick.

    time : of the cycle [s]; -1 before it
    """

    def __init__(self, path: Path, session: Session) -> None:
        self._path, self._session = path, session
        self._began = math.inf
        self.time = -1.0

    def state(self) -> State | None:
        """State of the newest tick; None: no tick yet."""
        records = recording.read(self._path).records
        if not len(records):
            return None
        newest, state = records[-1], State(int(records[-1]["state"]))
        if state is State.RUN:
            self._began = min(self._began, float(newest["now"]))
        self.time = max(-1.0, float(newest["now"]) - self._began)
        self._session.screen.show(moment(newest, self.time, self._session.config))
        return state


def moment(tick: np.void, cycle_time: float, config: Config) -> Moment:
    """Moment of a tick for the screen; cycle_time [s]."""
    drum_speed = float(tick["measured_drum_speed"])
    return Moment(
        time=cycle_time,
        state=State(int(tick["state"])).name,
        setpoint=float(tick["setpoint_speed_setpoint"]),
        motor_speed=float(tick["measured_motor_speed"]),
        drum_speed=drum_speed,
        rim_speed=drum_speed * config.bench.drum_radius,
        shaft_torque=float(tick["measured_shaft_torque"]),
        latency=float(tick["latency"]),
        missed=int(tick["missed"]),
    )


class _ScanClock:
    """Clock of an emulator that scans on request: to sleep is to scan."""

    def __init__(self, emulator: EmulatorSwitches) -> None:
        self._emulator, self._scans = emulator, 0

    def now(self) -> float:
        """Time of the last scan [s]."""
        return self._scans * SCAN

    def sleep_until(self, deadline: float) -> None:
        """Let the emulator scan until this time [s]."""
        scans = round(deadline / SCAN) - self._scans
        if scans > 0:
            self._emulator.step(scans)
            self._scans += scans


class _FileSink:
    """Writes the records of a fast loop to a file, and shows some of them.

    state, now, began : state and time of the newest tick, and the time at which RUN began [s]
    """

    dropped, failed = 0, False

    def __init__(self, path: Path, header: Header, session: Session) -> None:
        self._file = path.open("wb")
        self._file.write(header.encode())
        self._dtype, self._session = np.dtype(header.layout.formats), session
        self.state, self.began, self.now = State.OFF, math.inf, 0.0
        self._shown = -1.0

    def push(self, record: bytes) -> None:
        """Append one record."""
        self._file.write(record)
        tick = np.frombuffer(record, dtype=self._dtype)[0]
        self.state, self.now = State(int(tick["state"])), float(tick["now"])
        if self.state is State.RUN:
            self.began = min(self.began, self.now)
        if self.now - self._shown >= LOOK_EVERY:
            self._shown = self.now
            self._session.screen.show(moment(tick, self.time, self._session.config))

    @property
    def time(self) -> float:
        """Time since RUN began [s]; -1 before it."""
        return max(-1.0, self.now - self.began)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def operate_fast(session: Session) -> GatewayRun:
    """Run the loop through one cycle as fast as this computer allows. Raises GatewayError."""
    config = session.config
    register_map = register_maps.load(config.plc.map)
    clock = _ScanClock(session.emulator)
    header = Header.of(config, register_map, started=0.0, shadow=False, real_time="not asked for")
    path = session.file.with_suffix(SUFFIX)
    sink = _FileSink(path, header, session)
    link = TcpLink(config.plc.host, config.plc.port, config.plc.unit, 1.0)
    loop = Loop(config=config, register_map=register_map, link=link, sink=sink, clock=clock)
    remote = False

    def stop_requested() -> bool:
        nonlocal remote
        wanted = sink.state is State.ARMED or (
            sink.state is State.RUN and sink.time <= session.duration
        )
        if wanted is not remote:
            session.emulator.set_remote(on=wanted)
            remote = wanted
        if sink.state is not State.RUN and sink.time < 0.0 and sink.now > CHANGE_WITHIN:
            raise GatewayError(f"the gateway did not come to RUN within {CHANGE_WITHIN:g} s")
        return sink.state is State.SAFE

    try:
        loop.run(stop_requested)
    finally:
        sink.close()
    return GatewayRun(recording=path, exit_code=0)
