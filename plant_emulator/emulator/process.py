"""Starts an emulator in its own process. The demo and the system tests use it as their PLC.

    with EmulatorProcess(truck_mass=3640.0, driver="none") as emulator:
        ...connect to emulator.port...
        emulator.set_remote(on=True)

The process runs `plant-emulator serve --control` in its own session: a Ctrl-C in the terminal then
reaches the gateway first. The process ends with its standard input, so it cannot outlive its owner.
"""

import json
import os
import selectors
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from plant_emulator.errors import EmulatorError
from plant_emulator.signals.log import Log

# [s] The first start on a machine compiles the bench, which takes minutes at worst.
START_TIMEOUT = 180.0
ANSWER_TIMEOUT = 60.0
STOP_TIMEOUT = 10.0
ROOT = Path(__file__).resolve().parents[2]
FLAGS = {
    "parameters": "--parameters",
    "map": "--map",
    "host": "--host",
    "port": "--port",
    "speed": "--speed",
    "driver": "--driver",
    "remote_after": "--remote-after",
    "duration": "--duration",
    "log": "--log",
}
REPEATED = {"effects": "--effect", "faults": "--fault"}


class ProcessError(EmulatorError):
    """The emulator's process did not start, did not answer, or refused a request."""


class EmulatorProcess:
    """An emulator in its own process, as a context manager.

    options : fields of `emulator.Options`; the default port is 0 (any free one)
    With speed=None the emulator scans only when `step` is called.
    """

    def __init__(self, **options: Any) -> None:
        self.arguments = _arguments({"port": 0} | options)
        self.host, self.port = "", 0
        self.report = ""
        self._process: subprocess.Popen[bytes] | None = None
        self._buffer = b""
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed in `stop`

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    @property
    def pid(self) -> int:
        """Process id."""
        return self._running().pid

    def start(self) -> None:
        """Start the process and wait until its server listens."""
        path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
        self._process = subprocess.Popen(
            [sys.executable, "-m", "plant_emulator", "serve", "--control", *self.arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            env={**os.environ, "PYTHONPATH": path},
            start_new_session=True,
        )
        try:
            address = self._read_line(START_TIMEOUT).rpartition(" ")[2]
        except BaseException:
            self.stop()
            raise
        self.host, _, port = address.rpartition(":")
        self.port = int(port)

    def stop(self) -> int:
        """End the process and return its exit code. `report` then holds its timing report."""
        if self._process is None:
            return 0
        process, self._process = self._process, None
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.close()
        try:
            code = process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
            code = process.wait()
        process.stdout.close()
        self.report = self._read_errors()
        self._errors.close()
        return code

    def set_remote(self, *, on: bool) -> None:
        """Turn the operator's remote switch."""
        self.ask(do="remote", on=on)

    def set_faults(self, *names: str) -> None:
        """Replace all faults: each is `NAME` or `NAME@SECONDS` of PLC time."""
        self.ask(do="faults", names=list(names))

    def open_interlocks(self, *names: str) -> None:
        """Open these members of `Interlock` and close the others."""
        self.ask(do="interlock", open=list(names))

    def step(self, scans: int) -> None:
        """Run so many scans; only for an emulator with speed=None."""
        self.ask(do="step", scans=scans)

    def status(self) -> dict[str, Any]:
        """PLC time, state, alarms, speeds and timing; see `control_channel.py`."""
        answer: dict[str, Any] = self.ask(do="status")
        return answer

    def log(self) -> Log:
        """The log so far. Call it after a run, because the answer takes longer than a scan."""
        signals = {name: np.array(values) for name, values in self.ask(do="log").items()}
        return Log(signals.pop("time"), signals, "emulator")

    def ask(self, **request: Any) -> Any:
        """Send one request on the control channel; return its answer or raise ProcessError."""
        stdin = self._running().stdin
        assert stdin is not None
        stdin.write(json.dumps(request).encode() + b"\n")
        stdin.flush()
        answer = json.loads(self._read_line(ANSWER_TIMEOUT))
        if "error" in answer:
            raise ProcessError(answer["error"])
        return answer["ok"]

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            raise ProcessError("the emulator is not running; use it in a with block")
        return self._process

    def _read_line(self, timeout: float) -> str:
        """Next line of the process's standard output."""
        stdout = self._running().stdout
        assert stdout is not None
        deadline = time.monotonic() + timeout
        with selectors.DefaultSelector() as selector:
            selector.register(stdout, selectors.EVENT_READ)
            while b"\n" not in self._buffer:
                if not selector.select(max(0.0, deadline - time.monotonic())):
                    raise ProcessError(f"the emulator said nothing for {timeout:g} s")
                data = os.read(stdout.fileno(), 1 << 16)
                if not data:
                    raise ProcessError(f"the emulator ended: {self._read_errors()}")
                self._buffer += data
        line, _, self._buffer = self._buffer.partition(b"\n")
        return line.decode()

    def _read_errors(self) -> str:
        """Standard error of the process so far."""
        self._errors.seek(0)
        return self._errors.read().decode(errors="replace").strip()


def _arguments(options: dict[str, Any]) -> list[str]:
    """Command-line arguments for these fields of `emulator.Options`."""
    known = {*FLAGS, *REPEATED, "truck_mass", "remote"}
    if unknown := options.keys() - known:
        raise ProcessError(f"unknown options {sorted(unknown)}; known: {sorted(known)}")
    arguments = []
    for name, value in options.items():
        if name in REPEATED:
            arguments += [part for text in value for part in (REPEATED[name], text)]
        elif name == "truck_mass":
            arguments += ["--truck", "none" if value is None else str(value)]
        elif name == "remote":
            arguments += ["--remote" if value else "--local"]
        elif name == "speed" and value is None:
            arguments += ["--stepped"]
        elif value is not None:
            arguments += [FLAGS[name], str(value)]
    return arguments
