"""Time of one read and one write over a link to a PLC: ours, and libmodbus in C, side by side.

Both clients ask the same PLC of the tests, which is behind libmodbus, too. Each of them gets real
time and a processor of its own, apart from its PLC's, where the computer grants it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import time
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from gateway.link.device import open_link
from gateway.runtime.realtime import real_time
from register_maps import load

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gateway.link.plc import TcpLink

MAP = load("bench_int16")
SOURCES = Path(__file__).resolve().parents[2] / "tests/system"
ROUNDS, CYCLES = 15, 1000
PLC_PRIORITY = 20


class NoPeerError(Exception):
    """A peer cannot run; the message says what it lacks."""


def measure() -> tuple[float, float]:
    """Median duration of a cycle of ours and of libmodbus [s]. Raises NoPeerError."""
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        plc, client = (
            built(SOURCES / f"libmodbus_{name}.c", Path(folder)) for name in ("plc", "client")
        )
        ports = [stack.enter_context(running(plc)) for _ in range(2)]
        blocks = (MAP.measurement.count, MAP.command.start, MAP.command.count, CYCLES)
        words = [str(word) for word in (ports[0], *blocks)]
        theirs = stack.enter_context(libmodbus(client, *words))
        ours = stack.enter_context(open_link("127.0.0.1", ports[1], 1, 1.0))
        with real_time(), processor(0, 1):
            found = [(cycle(ours), ask(theirs)) for _ in range(ROUNDS)]
    first, second = zip(*found, strict=True)
    return median(first), median(second)


def built(source: Path, folder: Path) -> Path:
    """Program made of one C file with libmodbus. Raises NoPeerError."""
    if not (shutil.which("gcc") and shutil.which("pkg-config")):
        raise NoPeerError("no C compiler")
    flags = ["pkg-config", "--cflags", "--libs", "libmodbus"]
    found = subprocess.run(flags, capture_output=True, text=True, check=False)
    if found.returncode:
        raise NoPeerError("no libmodbus")
    program = folder / source.stem
    command = ["gcc", "-O2", "-o", str(program), str(source), *found.stdout.split(), "-lm"]
    subprocess.run(command, check=True)
    return program


@contextmanager
def running(program: Path) -> Iterator[int]:
    """Port of a running PLC."""
    with subprocess.Popen([program], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            port = int(process.stdout.readline().rpartition(":")[2])
            with suppress(OSError):
                os.sched_setscheduler(process.pid, os.SCHED_FIFO, os.sched_param(PLC_PRIORITY))
            with processor(process.pid, 0):
                yield port
        finally:
            process.terminate()


@contextmanager
def libmodbus(program: Path, *words: str) -> Iterator[subprocess.Popen[str]]:
    """The client in C, beside ours on the same processor; one of them sleeps."""
    with subprocess.Popen(
        [program, *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        with suppress(OSError):
            os.sched_setscheduler(process.pid, os.SCHED_FIFO, os.sched_param(PLC_PRIORITY))
        with processor(process.pid, 1):
            yield process


@contextmanager
def processor(process: int, number: int) -> Iterator[None]:
    """Bind a process (0: this one) to one of the allowed processors, if there are two."""
    allowed = os.sched_getaffinity(process)
    if len(allowed) > 1:
        os.sched_setaffinity(process, {sorted(allowed)[number]})
    try:
        yield
    finally:
        with suppress(OSError):
            os.sched_setaffinity(process, allowed)


def ask(process: subprocess.Popen[str]) -> float:
    """Median of one round of the client in C [s]."""
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write("\n")
    process.stdin.flush()
    return float(process.stdout.readline())


def cycle(link: TcpLink) -> float:
    """Median of one round of our client [s]."""
    measurement, command = MAP.measurement, MAP.command
    words, durations = (0,) * command.count, []
    for _ in range(CYCLES):
        begun = time.perf_counter()
        link.read(measurement.start, measurement.count)
        link.write(command.start, words)
        durations.append(time.perf_counter() - begun)
    return median(durations)
