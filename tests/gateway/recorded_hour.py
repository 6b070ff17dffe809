"""An hour of recording: its size before and after compression, and the memory of its export.

    python -m tests.gateway.recorded_hour

A truck drives 15 minutes of emulated time with noisy sensors, in which the 16-bit counters wrap.
The records are those of the daemon. Four such stretches, one after another, make the hour. Beside
the sizes stand the memory, threads and open files of the tick after each 5 minutes.
"""

import subprocess
import sys
import tempfile
import threading
import time
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gateway.configuration.config import Config
from gateway.cycle.record import NOTHING, Layout, Tick
from gateway.cycle.supervisor import State
from gateway.recordings.header import Header
from gateway.recordings.parts import compress
from register_maps.codec import encode_measurement, encode_setpoint
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop
from tests.gateway.drifted_bench import Noisy, Travels

STRETCH, STRETCHES, LOOK = 900.0, 4, 300.0
SEED = 7


def driven() -> ClosedLoop:
    """A running loop whose truck drives on and on."""
    random = np.random.default_rng(SEED)
    loop = ClosedLoop(
        Config(),
        driver=lambda truck: Travels(truck, "pi", random),
        disturb=Noisy(np.random.default_rng(SEED)),
    )
    loop.start()
    return loop


def ticks(loop: ClosedLoop, count: int) -> Iterator[Tick]:
    """Ticks as the daemon records them, one a scan."""
    chance = np.random.default_rng(SEED)
    for number in range(count):
        loop.run(SCAN)
        seen, output = loop.observations[-1], loop.last
        loop.outputs[:-1] = []
        for kept in (loop.observations, loop.drum_speed, loop.wheel_torque):
            kept.clear()  # a loop of the tests keeps its history; the daemon does not
        assert output.state is State.RUN
        assert seen.measurement is not None
        assert output.setpoint is not None
        yield Tick(
            tick=number,
            now=1000.0 + number * SCAN,
            period=SCAN,
            lateness=float(chance.gamma(2.0, 3e-5)),
            latency=float(chance.gamma(4.0, 2e-4)),
            age=output.age,
            demand=output.demand,
            missed=0,
            overruns=0,
            dropped=0,
            fault=NOTHING,
            reason=NOTHING,
            state=output.state,
            shadow=False,
            stop_requested=False,
            written=True,
            words_read=tuple(encode_measurement(loop.map, seen.measurement)),
            words_written=tuple(encode_setpoint(loop.map, output.setpoint)),
            measurement=seen.measurement,
            setpoint=output.setpoint,
        )


def again(stretch: bytes, layout: Layout, times: int) -> bytes:
    """The records of a stretch so many stretches later."""
    records = np.frombuffer(stretch, np.dtype(layout.formats)).copy()
    count = times * len(records)
    records["tick"] += count
    records["now"] += count * SCAN
    records["measured_plc_time"] += count * SCAN
    for name in ("measured_sequence_start", "measured_sequence_end"):
        records[name] = (records[name] + count) % 65536
    for number in range(len(records)):
        records["crc"][number] = zlib.crc32(records[number].tobytes()[:-4])
    return records.tobytes()


def resources() -> str:
    """Memory, threads and open files of this process."""
    resident = memory(Path("/proc/self/status"), "VmRSS")
    files = len(list(Path("/proc/self/fd").iterdir()))
    return f"{resident:.1f} MB, {threading.active_count()} threads, {files} files"


def memory(status: Path, name: str) -> float:
    """Memory of a process by the kernel's name [MB]; 0 where it has ended."""
    lines = status.read_text().splitlines()
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith(name)), 0.0)


def exported(path: Path) -> float:
    """Largest memory of the export of a recording to CSV [MB], as seen every 20 ms.

    The kernel's own figure for a child begins with the memory of its parent.
    """
    arguments = ["-m", "gateway", "export", str(path), "--to", str(path.with_suffix(".csv"))]
    largest = 0.0
    with subprocess.Popen([sys.executable, *arguments]) as child:
        while child.poll() is None:
            largest = max(largest, memory(Path(f"/proc/{child.pid}/status"), "VmHWM"))
            time.sleep(0.02)
    assert child.returncode == 0
    return largest


def main() -> None:
    """Drive, record, compress, export, and print what it takes."""
    loop = driven()
    layout, count = Layout.of(loop.map), round(STRETCH / SCAN)
    with tempfile.TemporaryFile() as file:
        for tick in ticks(loop, count):
            file.write(layout.pack(tick))
            if (tick.tick + 1) % round(LOOK / SCAN) == 0:
                print(f"{(tick.tick + 1) * SCAN:.0f} s: {resources()}", flush=True)
        file.seek(0)
        stretch = file.read()
    head = Header.of(loop.config, loop.map, started=1000.0, shadow=False, real_time="no")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "hour.rlrec"
        with path.open("wb") as file:
            file.write(head.encode())
            for times in range(STRETCHES):
                file.write(again(stretch, layout, times))
        before, begun = path.stat().st_size, time.process_time()
        compress(path)
        took, closed = time.process_time() - begun, path.with_suffix(".rlrec.gz")
        print(f"an hour: {before / 1e6:.1f} MB, compressed {closed.stat().st_size / 1e6:.1f} MB")
        print(f"compression: {took:.1f} s of a processor")
        print(f"export to CSV: {exported(closed):.0f} MB of memory")


if __name__ == "__main__":
    main()
