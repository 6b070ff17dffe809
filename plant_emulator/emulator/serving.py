"""Runs an emulator until it is told to stop: loop, signals, pace, control channel, last words.

Scans run in a thread of their own (`pace.py`), requests are answered in the loop. Both touch only
references to tuples, which Python exchanges as a whole.
"""

import asyncio
import contextlib
import gc
import os
import signal
import sys
from collections.abc import Callable

from plant_emulator import logs
from plant_emulator.emulator.control_channel import Control
from plant_emulator.emulator.emulator import Emulator, Options, build
from plant_emulator.emulator.plc.plc import SCAN
from plant_emulator.emulator.scan_timer import Pace

LIVE_EVERY = 1.0
PRIORITY = 20


class _Run:
    """One run of an emulator, all in the loop's thread unless it says otherwise."""

    def __init__(self, options: Options, emulator: Emulator) -> None:
        self.options, self.emulator = options, emulator
        self.loop = asyncio.get_running_loop()
        self.stopping = asyncio.Event()
        self.failure: Exception | None = None
        self.faults: frozenset[str] = frozenset()
        self.tasks: set[asyncio.Task[None]] = set()
        self.pace: Pace | None = None
        if options.speed is not None:
            self.pace = Pace(self.scan, SCAN / options.speed, self.failed)
        emulator.changed = self.faults_changed

    def scan(self) -> None:
        """One scan; in the pace's thread."""
        self.emulator.scan()
        duration = self.options.duration
        if duration is not None and self.emulator.plc.time >= duration:
            self.loop.call_soon_threadsafe(self.stopping.set)

    def failed(self, error: Exception) -> None:
        """Stop because a scan raised; in the pace's thread."""
        self.failure = error
        self.loop.call_soon_threadsafe(self.stopping.set)

    def faults_changed(self, names: frozenset[str]) -> None:
        """Take the port's faults over; in the thread that scans."""
        self.loop.call_soon_threadsafe(self.start_task, names)

    def start_task(self, names: frozenset[str]) -> None:
        """Switch the server's faults."""
        task = self.loop.create_task(self.emulator.server.misbehave(names))
        self.tasks.add(task)
        task.add_done_callback(self.task_done)

    def task_done(self, task: asyncio.Task[None]) -> None:
        """Forget it, unless the port could not be had again."""
        self.tasks.discard(task)
        if not task.cancelled() and isinstance(error := task.exception(), Exception):
            self.failed(error)


async def serve(options: Options, announce: Callable[[str], None], *, control: bool) -> str:
    """Emulate until SIGINT, SIGTERM, the duration or a request; how real time was held, in words.

    announce : prints a line at once; the first one says where the server listens
    control : requests come in on standard input, and its end is the end of the run
    """
    emulator = build(options)
    run = _Run(options, emulator)
    for number in (signal.SIGINT, signal.SIGTERM):
        run.loop.add_signal_handler(number, run.stopping.set)
    # One scan before anybody can look: there is no image without one.
    emulator.scan()
    if options.log is not None:
        logs.rehearse(emulator.log(), options.log)
    await emulator.server.start()
    gc.collect()
    gc.freeze()
    policy = _ask_for_real_time(options.speed)
    announce(f"listening on {options.host}:{emulator.server.port}")
    try:
        await _until_stopped(run, announce, control=control)
    finally:
        if run.pace is not None:
            run.pace.stop()
        await emulator.server.stop()
        gc.unfreeze()
    if options.log is not None:
        emulator.write_log(options.log)
    if run.failure is not None:
        raise run.failure
    said = f"{run.pace.report()}, {policy}" if run.pace else f"{emulator.plc.scans} scans"
    return said + unsettled_text(emulator)


def unsettled_text(emulator: Emulator) -> str:
    """What is wrong with the bench itself, in words; nothing as a rule."""
    stages = emulator.plc.bench.unsettled
    return f", {stages} IMPLICIT STAGES OF THE BENCH DID NOT SETTLE" if stages else ""


def _ask_for_real_time(speed: float | None) -> str:
    """Scheduling as a PLC has it, below the gateway's own; what we got, in a word.

    Not for an emulator that is faster than time: it could take all that a processor has.
    """
    if speed is not None and speed <= 1.0:
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
            return "SCHED_FIFO"
    return "ordinary scheduling"


async def _until_stopped(run: _Run, announce: Callable[[str], None], *, control: bool) -> None:
    others = []
    if control:
        others.append(_answer(Control(run.emulator, run.pace, run.stopping.set), run, announce))
    if run.pace is not None:
        run.pace.start()
        if sys.stderr.isatty():
            others.append(_show(run.pace, run.emulator))
    tasks = [asyncio.create_task(other) for other in others]
    await run.stopping.wait()
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


async def _answer(control: Control, run: _Run, announce: Callable[[str], None]) -> None:
    """Answer requests; their end means that nobody is there to stop us any more."""
    reader = asyncio.StreamReader()
    protocol = asyncio.StreamReaderProtocol(reader)
    transport, _ = await run.loop.connect_read_pipe(lambda: protocol, sys.stdin)
    with contextlib.closing(transport):
        while line := await reader.readline():
            announce(control.answer(line.decode()))
    run.stopping.set()


async def _show(pace: Pace, emulator: Emulator) -> None:
    """One line on the terminal, renewed each second."""
    while True:
        await asyncio.sleep(LIVE_EVERY)
        plc = emulator.plc
        line = (
            f"t {plc.time:8.1f} s  {plc.state.name:<9}{unsettled_text(emulator)}  {pace.report()}"
        )
        sys.stderr.write(f"\r\x1b[K{line[:150]}")
        sys.stderr.flush()
