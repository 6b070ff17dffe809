"""Runs an emulator until a signal, a request or its duration ends it.

The scan timer runs the scans in its own thread. The asyncio loop answers requests. The two threads
share only references to tuples, which Python replaces atomically.
"""

import asyncio
import contextlib
import gc
import os
import selectors
import signal
import sys
from collections.abc import AsyncIterator, Callable

from plant_emulator import logs
from plant_emulator.emulator.control_channel import ControlChannel
from plant_emulator.emulator.emulator import Emulator, Options, build
from plant_emulator.emulator.operator_socket import serve_operator
from plant_emulator.emulator.scan_timer import ScanTimer
from register_maps.timing import SCAN

LIVE_EVERY = 1.0  # [s] between two lines on the terminal
PRIORITY = 20


class _Run:
    """One run of an emulator. Its methods run in the loop's thread unless they say otherwise."""

    def __init__(self, options: Options, emulator: Emulator) -> None:
        self.options, self.emulator = options, emulator
        self.loop = asyncio.get_running_loop()
        self.stopping = asyncio.Event()
        self.failure: Exception | None = None
        self.tasks: set[asyncio.Task[None]] = set()
        self.timer: ScanTimer | None = None
        if options.speed is not None:
            self.timer = ScanTimer(self.scan, SCAN / options.speed, self.fail)
        emulator.on_faults_changed = self.on_faults_changed

    def scan(self) -> None:
        """Run one scan, in the timer's thread."""
        self.emulator.scan()
        duration = self.options.duration
        if duration is not None and self.emulator.plc.time >= duration:
            self.loop.call_soon_threadsafe(self.stopping.set)

    def fail(self, error: Exception) -> None:
        """Stop because of an error, in any thread."""
        self.failure = error
        self.loop.call_soon_threadsafe(self.stopping.set)

    def on_faults_changed(self, names: frozenset[str]) -> None:
        """Pass the new faults to the server, in the thread that scans."""
        self.loop.call_soon_threadsafe(self.start_task, names)

    def start_task(self, names: frozenset[str]) -> None:
        """Apply the faults to the server."""
        task = self.loop.create_task(self.emulator.server.apply_faults(names))
        self.tasks.add(task)
        task.add_done_callback(self.end_task)

    def end_task(self, task: asyncio.Task[None]) -> None:
        """Drop a finished task; stop if the server could not listen again."""
        self.tasks.discard(task)
        if not task.cancelled() and isinstance(error := task.exception(), Exception):
            self.fail(error)


async def serve(options: Options, announce: Callable[[str], None], *, control: bool) -> str:
    """Run the emulator until SIGINT, SIGTERM, its duration or a request; return a timing report.

    announce : prints a line at once; the first line says where the server listens
    control : read requests from standard input, and stop at its end
    Raises PortError if the server cannot listen, and any error of a scan.
    """
    emulator = build(options)
    run = _Run(options, emulator)
    for number in (signal.SIGINT, signal.SIGTERM):
        run.loop.add_signal_handler(number, run.stopping.set)
    # A client must not see the server before the first scan has made an image.
    emulator.scan()
    if options.log is not None:
        logs.rehearse(emulator.log(), options.log)
    await emulator.server.start()
    gc.collect()
    gc.freeze()
    policy = _ask_for_real_time(options.speed)
    try:
        await _until_stopped(run, announce, control=control)
    finally:
        if run.timer is not None:
            run.timer.stop()
        await emulator.server.stop()
        gc.unfreeze()
    if options.log is not None:
        emulator.write_log(options.log)
    if run.failure is not None:
        raise run.failure
    timing = f"{run.timer.report()}, {policy}" if run.timer else f"{emulator.plc.scans} scans"
    return timing + unsettled_text(emulator)


def unsettled_text(emulator: Emulator) -> str:
    """Warning that the bench's equations were not solved; empty if they were."""
    stages = emulator.plc.bench.unsettled
    return f", {stages} IMPLICIT STAGES OF THE BENCH DID NOT SETTLE" if stages else ""


def _ask_for_real_time(speed: float | None) -> str:
    """Ask for real-time scheduling below the gateway's priority; return the policy's name.

    An emulator faster than real time does not ask, because it could use a whole processor.
    """
    if speed is not None and speed <= 1.0:
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
            return "SCHED_FIFO"
    return "ordinary scheduling"


async def _until_stopped(run: _Run, announce: Callable[[str], None], *, control: bool) -> None:
    others = []
    channel = ControlChannel(run.emulator, run.timer, run.stopping.set)
    if control:
        others.append(_answer(channel, run, announce))
    if run.timer is not None:
        run.timer.start()
        if sys.stderr.isatty():
            others.append(_show(run.timer, run.emulator))
    tasks = [asyncio.create_task(other) for other in others]
    port = run.emulator.server.port
    async with serve_operator(channel, port):
        announce(f"listening on {run.options.host}:{port}")
        await run.stopping.wait()
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


async def _answer(channel: ControlChannel, run: _Run, announce: Callable[[str], None]) -> None:
    """Answer requests until standard input ends, then stop the run."""
    async for line in _lines(run.loop):
        announce(channel.answer(line.decode()))
    run.stopping.set()


async def _lines(loop: asyncio.AbstractEventLoop) -> AsyncIterator[bytes]:
    """Lines of standard input."""
    try:
        with selectors.DefaultSelector() as selector:
            selector.register(sys.stdin, selectors.EVENT_READ)
    except PermissionError:  # a file, or /dev/null, which no loop can wait for and none has to
        for line in sys.stdin.buffer:
            yield line
        return
    reader = asyncio.StreamReader()
    protocol = asyncio.StreamReaderProtocol(reader)
    transport, _ = await loop.connect_read_pipe(lambda: protocol, sys.stdin)
    with contextlib.closing(transport):
        while line := await reader.readline():
            yield line


async def _show(timer: ScanTimer, emulator: Emulator) -> None:
    """Show one status line on the terminal and renew it each second."""
    while True:
        await asyncio.sleep(LIVE_EVERY)
        plc = emulator.plc
        line = (
            f"t {plc.time:8.1f} s  {plc.state.name:<9}{unsettled_text(emulator)}  {timer.report()}"
        )
        sys.stderr.write(f"\r\x1b[K{line[:150]}")
        sys.stderr.flush()
