"""Times of the gateway's tick in real time, alone and beside what may disturb it."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
import tempfile
import urllib.request
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from socket import create_server
from threading import Event, Thread
from typing import TYPE_CHECKING

import numpy as np

from gateway.recordings import recording
from plant_emulator.emulator.process import EmulatorProcess

if TYPE_CHECKING:
    from collections.abc import Iterator

LASTING = 15.0
# Ticks left out [s]: the first ones see the other processes of the gateway start.
SETTLING = 3.0
SCRAPES = 0.05
CONFIG = "[plc]\nport = {port}\n[recording]\ndir = '{folder}'\n"


def measure(*beside: str) -> dict[str, np.ndarray]:
    """Lateness and latency of every tick [s], armed against the emulator.

    beside : "busy", a process that computes for ever; "metrics", a reader of the metrics;
        "stalled", a terminal that takes nothing, in the place of no output
    """
    with (
        tempfile.TemporaryDirectory() as folder,
        EmulatorProcess(driver="none") as emulator,
        ExitStack() as stack,
    ):
        config = Path(folder) / "bench.toml"
        config.write_text(CONFIG.format(port=emulator.port, folder=folder))
        command = [sys.executable, "-m", "gateway", "run", "-c", str(config)]
        command += ["--duration", f"{LASTING + SETTLING:g}"]
        if "metrics" in beside:
            port = free_port()
            command += ["--metrics", f"127.0.0.1:{port}"]
            stack.enter_context(scraping(f"http://127.0.0.1:{port}/metrics"))
        if "busy" in beside:
            stack.enter_context(computing())
        output = stack.enter_context(stalled()) if "stalled" in beside else subprocess.DEVNULL
        environment = {**os.environ, "TERM": "xterm"}
        subprocess.run(command, check=True, stdout=output, env=environment)
        (file,) = Path(folder).glob("*.rlrec")
        records = recording.read(file).records
    settled = records[records["now"] >= records["now"][0] + SETTLING]
    return {name: settled[name].copy() for name in ("lateness", "latency")}


def free_port() -> int:
    """A port that nobody listens at."""
    with create_server(("127.0.0.1", 0)) as found:
        return int(found.getsockname()[1])


@contextmanager
def computing() -> Iterator[None]:
    """A second process that computes."""
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as process:
        try:
            yield
        finally:
            process.kill()


@contextmanager
def stalled() -> Iterator[int]:
    """A terminal that nobody reads: after some kilobytes it takes nothing."""
    reader, terminal = pty.openpty()
    try:
        yield terminal
    finally:
        os.close(terminal)
        os.close(reader)


@contextmanager
def scraping(address: str) -> Iterator[None]:
    """A reader that asks for the metrics twenty times a second."""
    over = Event()

    def scrape() -> None:
        while not over.wait(SCRAPES):
            with suppress(OSError), urllib.request.urlopen(address, timeout=5) as answer:
                answer.read()

    thread = Thread(target=scrape)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def quantiles(durations: np.ndarray) -> tuple[float, float, float]:
    """Median, 99 % quantile and the longest [s]."""
    return (*np.quantile(durations, (0.5, 0.99)), durations.max())
