"""`gateway run` as a process, for tests: its configuration, its wait for a state, its recording."""

import csv
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from gateway.recordings import recording
from plant_emulator.emulator.process import EmulatorProcess

CONFIG = """
[plc]
port = {port}
map = "{map}"
[truck]
mass_kg = 3640.0
[recording]
dir = "recordings"
"""


def until(holds: Callable[[], bool], limit: float = 20.0) -> None:
    """Return as soon as it holds; fail after `limit` seconds."""
    end = time.monotonic() + limit
    while not holds():
        assert time.monotonic() < end, f"not within {limit} s"
        time.sleep(0.02)


def until_armed(emulator: EmulatorProcess) -> None:
    """Return when the gateway is armed: it has begun to write, and the PLC to accept."""
    until(lambda: emulator.status()["command_age"] is not None)


@dataclass(frozen=True, kw_only=True)
class Gateway:
    """A running gateway and the folder that it runs in."""

    process: subprocess.Popen[bytes]
    folder: Path

    def runs_for(self, seconds: float) -> None:
        """Let it run so long; fail if it ends by itself."""
        try:
            code = self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            return
        raise AssertionError(f"ended with {code}: {self.output}")

    @property
    def output(self) -> str:
        """What it has written to its terminal so far."""
        return (self.folder / "gateway.txt").read_text()

    def stop(self, number: int = signal.SIGTERM) -> int:
        """Send a signal; its exit code."""
        self.process.send_signal(number)
        return self.process.wait(20)

    def passed(self) -> list[str]:
        """Names of the states in the order of their first tick, from the recording itself."""
        (file,) = (self.folder / "recordings").glob("*.rlrec")
        made = recording.read(file)
        return list(dict.fromkeys(made.state(int(code)) for code in made.records["state"]))

    def rows(self) -> list[dict[str, str]]:
        """The recording as `gateway export` writes it."""
        recordings = self.folder / "recordings"
        (recording,) = [path for path in recordings.iterdir() if path.suffix == ".rlrec"]
        exported = self.folder / "export.csv"
        subprocess.run(
            [sys.executable, "-m", "gateway", "export", str(recording), "--to", str(exported)],
            check=True,
            timeout=60,
        )
        with exported.open(newline="") as file:
            return list(csv.DictReader(file))


@contextmanager
def gateway(
    folder: Path, port: int, *options: str, register_map: str = "bench_int16"
) -> Iterator[Gateway]:
    """Start the daemon against a PLC on that port; it is stopped at the end if it still runs."""
    config = folder / "gateway.toml"
    config.write_text(CONFIG.format(port=port, map=register_map))
    with (folder / "gateway.txt").open("wb") as output:
        process = subprocess.Popen(
            [sys.executable, "-m", "gateway", "run", "-c", str(config), *options],
            cwd=folder,
            stdout=output,
            stderr=subprocess.STDOUT,
        )
        try:
            yield Gateway(process=process, folder=folder)
        finally:
            if process.poll() is None:
                process.kill()
            process.wait()
