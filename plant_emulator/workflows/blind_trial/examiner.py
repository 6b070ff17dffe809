"""Runs one diagnosis in its own process, which gets nothing but the logs.

The logs are copied to an empty temporary folder, the working directory of the process. The process
runs the command `plant-emulator diagnose`, which imports nothing of the trial. It drafts no missing
law, because a trial does not judge drafts.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

from plant_emulator import parameter_sets
from plant_emulator.workflows.blind_trial.folder import ROOT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.model.parameters import ParameterSet


@dataclass(frozen=True)
class Outcome:
    """JSON answer and saved parameter set of a diagnosis; error: last line of a failed one."""

    answer: dict[str, Any] | None
    saved: ParameterSet | None
    error: str


@dataclass
class Examiner:
    """Runs diagnoses, also several at once, and can end them all."""

    stopped: bool = False
    _running: set[subprocess.Popen[str]] = field(default_factory=set)
    _lock: Lock = field(default_factory=Lock)

    def diagnose(self, logs: Sequence[Path]) -> Outcome:
        """Diagnose these logs."""
        with tempfile.TemporaryDirectory(prefix="blind-") as name:
            folder = Path(name)
            for log in logs:
                shutil.copyfile(log, folder / log.name)
            code, errors = self._run([log.name for log in logs], folder)
            if code != 0:
                last = errors.strip().splitlines()[-1:] or [f"exit code {code}"]
                return Outcome(None, None, last[0])
            answer = json.loads((folder / "answer.json").read_text(encoding="utf-8"))
            return Outcome(answer, parameter_sets.load(str(folder / "set.toml")), "")

    def _run(self, logs: Sequence[str], folder: Path) -> tuple[int, str]:
        """Exit code and standard error of the command."""
        command = [sys.executable, "-m", "plant_emulator", "diagnose", *logs]
        command += ["--workers", "1", "--json", "answer.json", "--save", "set.toml", "--no-draft"]
        given = os.environ.get("PYTHONPATH", "")
        with self._lock:
            if self.stopped:
                return -1, "stopped"
            # In its own session the process gets no Ctrl-C; the trial handles it.
            process = subprocess.Popen(
                command,
                cwd=folder,
                env={**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{given}"},
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                start_new_session=True,
            )
            self._running.add(process)
        try:
            _, errors = process.communicate()
        finally:
            with self._lock:
                self._running.discard(process)
        return process.returncode, errors

    def stop(self) -> None:
        """End all diagnoses and start no more."""
        with self._lock:
            self.stopped = True
            for process in self._running:
                process.terminate()
