"""Soak over the link: run after run, with memory, files, threads and counters of the gateway.

    python -m tests.gateway.soak 30

Each run arms, drives a truck for 30 s, ramps down and is acknowledged, 35 s of emulated time. Loop,
link, recorder and status block are those of the daemon. The emulator scans while the loop waits, so
that emulated time passes as fast as the computer allows. The 16-bit counters wrap after 655 s.
"""

import multiprocessing
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from gateway.configuration.config import Config
from gateway.cycle.record import Tick
from gateway.cycle.supervisor import State
from gateway.link.plc import TcpLink
from gateway.monitoring.shared import Publisher
from gateway.recordings.header import Header
from gateway.recordings.recorder import Job, Recorder
from gateway.runtime.loop import Loop
from plant_emulator.emulator.process import EmulatorProcess
from register_maps import load
from tests.gateway.monitoring.identities import IDENTITY
from tests.gateway.recorded_hour import memory
from tests.gateway.runtime.test_loop import Bench

MAP = load("bench_int16")
DRIVE, PATIENCE = 30.0, 5.0
"""[s] Length of a drive; time for each step of the operator."""


@dataclass(frozen=True, kw_only=True)
class Found:
    """State after a run: resident memory of gateway and recorder [MB], open files, threads.

    wraps : of the PLC's sample number and of the command's number so far
    lost, dropped : ticks without a good image, records that the recorder did not get
    """

    gateway: float
    recorder: float
    files: int
    threads: int
    wraps: tuple[int, int]
    lost: int
    dropped: int


class Soak:
    """A gateway that runs again and again in virtual time. `files_in` : folder of its files."""

    def __init__(self, emulator: EmulatorProcess, files_in: Path) -> None:
        self.bench, self.files_in = Bench(emulator), files_in
        self.config = Config().with_values({"plc.port": str(emulator.port)})
        self.ticks = self.lost = 0
        self.before: Tick | None = None
        self.wraps = [0, 0]

    def runs(self, count: int, drive: float = DRIVE) -> Iterator[Found]:
        """What is found after each of so many runs; drive [s]. Raises AssertionError for a trip."""
        head = Header.of(self.config, MAP, started=1000.0, shadow=False, real_time="no")
        job = Job(path=self.files_in / "soak.rlrec", header=head)
        with closing(Recorder(job)) as recorder, Publisher(IDENTITY) as publisher:
            (child,) = multiprocessing.active_children()
            link = TcpLink("127.0.0.1", self.config.plc.port, 1, 1.0, probe=MAP.measurement)
            self.loop = Loop(
                config=self.config,
                register_map=MAP,
                link=link,
                sink=recorder,
                clock=self.bench,
                observe=lambda tick: (publisher(tick), self.note(tick)),
            )
            with closing(link):
                for _ in range(count):
                    self.run(drive)
                    yield Found(
                        gateway=memory(Path("/proc/self/status"), "VmRSS"),
                        recorder=memory(Path(f"/proc/{child.pid}/status"), "VmRSS"),
                        files=len(list(Path("/proc/self/fd").iterdir())),
                        threads=threading.active_count(),
                        wraps=(self.wraps[0], self.wraps[1]),
                        lost=self.lost,
                        dropped=recorder.dropped,
                    )

    def note(self, tick: Tick) -> None:
        """Count wraps of the counters, and ticks without a good image."""
        before, self.before = self.before, tick
        self.lost += tick.measurement is None
        if before is None:
            return
        if before.measurement and tick.measurement:
            self.wraps[0] += tick.measurement.sequence_start < before.measurement.sequence_start
        if before.setpoint and tick.setpoint:
            self.wraps[1] += tick.setpoint.command_sequence < before.setpoint.command_sequence

    def run(self, drive: float) -> None:
        """Arm, start, drive, end, acknowledge."""
        self.until(State.ARMED)
        self.switch(remote=True, to=State.RUN)
        for _ in range(round(drive / self.config.loop.period)):
            assert self.tick() is State.RUN, self.loop._state.supervisor
        self.switch(remote=False, to=State.SAFE)
        self.switch(remote=True, to=State.SHADOW)
        self.bench.emulator.set_remote(on=False)

    def switch(self, *, remote: bool, to: State) -> None:
        """Turn the switch, and go on until this state."""
        self.bench.emulator.set_remote(on=remote)
        self.until(to)

    def until(self, state: State) -> None:
        """Go on until this state. Raises AssertionError where it does not come."""
        for _ in range(round(PATIENCE / self.config.loop.period)):
            if self.tick() is state:
                return
        raise AssertionError(f"not {state.name}: {self.loop._state.supervisor}")

    def tick(self) -> State:
        """One tick of the loop; its state."""
        deadline = 1000.0 + self.ticks * self.config.loop.period
        self.ticks += 1
        self.bench.sleep_until(deadline)
        return self.loop.tick(deadline, stop_requested=False).state


def main(count: int) -> None:
    """Print what is found after each run."""
    with (
        EmulatorProcess(speed=None, driver="none") as emulator,
        tempfile.TemporaryDirectory() as folder,
    ):
        soak = Soak(emulator, Path(folder))
        for number, found in enumerate(soak.runs(count), 1):
            elapsed = soak.ticks * soak.config.loop.period
            print(f"{number:4d} runs, {elapsed:6.0f} s: {found}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]))
