"""A diagnosis on a Dask cluster: a scheduler and two workers, each a process of its own."""

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plant_emulator.errors import EmulatorError
from plant_emulator.workflows.workers import Cluster
from tests.plant_emulator.diagnosis import axis_truth
from tests.plant_emulator.workflows.test_workers import Number

pytestmark = pytest.mark.slow

QUIET = ["--no-dashboard", "--dashboard-address", "127.0.0.1:0"]


@contextlib.contextmanager
def process(module: str, *options: str) -> Iterator[subprocess.Popen[str]]:
    """A program of the cluster; it is ended with the test."""
    command = [sys.executable, "-m", module, *options]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        yield running
    finally:
        running.terminate()
        running.communicate(timeout=30)


def told(running: subprocess.Popen[str], text: str) -> str:
    """The rest of the first line of its log that holds this text."""
    assert running.stderr is not None
    for line in running.stderr:
        if text in line:
            return line.split(text)[1].strip()
    raise AssertionError(f"ended without telling {text!r}")


@pytest.fixture
def scheduler() -> Iterator[str]:
    with contextlib.ExitStack() as running:
        options = ["--host", "127.0.0.1", "--port", "0", *QUIET]
        first = running.enter_context(process("distributed.cli.dask_scheduler", *options))
        address = told(first, "Scheduler at:")
        one = [address, "--host", "127.0.0.1", "--nthreads", "1", "--no-nanny", *QUIET]
        for _ in range(2):
            worker = running.enter_context(process("distributed.cli.dask_worker", *one))
            told(worker, "Registered to:")
        yield address


@pytest.fixture
def logs(tmp_path: Path) -> list[str]:
    files = []
    for seed, phase in ((1, 0.0), (2, 2.0)):
        log = axis_truth.log(lambda q, v, a: 40.0 * np.maximum(v, 0.0), phase=phase, seed=seed)
        file = tmp_path / f"run{seed}.csv"
        table = np.column_stack([log.time, log.position, log.force])
        np.savetxt(file, table, delimiter=",", header="time_s,position_m,force_N", comments="")
        files.append(str(file))
    return files


def answer(logs: list[str], folder: Path, *options: str) -> dict[str, Any]:
    file = folder / "answer.json"
    command = [sys.executable, "-m", "plant_emulator", "diagnose", "--model", "axis", *logs]
    command += [*options, "--json", str(file)]
    done = subprocess.run(command, check=False, timeout=300, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(file.read_text())
    assert isinstance(found, dict)
    return found


def test_the_answer_is_that_of_one_process(scheduler: str, logs: list[str], tmp_path: Path) -> None:
    alone = answer(logs, tmp_path, "--workers", "1")
    assert alone["verdict"]["effects"] == ["viscous_asymmetry"]
    assert answer(logs, tmp_path, "--scheduler", scheduler) == alone


def test_a_scheduler_that_does_not_answer_is_told(logs: list[str]) -> None:
    command = [sys.executable, "-m", "plant_emulator", "diagnose", "--model", "axis", *logs]
    command += ["--scheduler", "tcp://127.0.0.1:1"]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == 1
    assert "--scheduler tcp://127.0.0.1:1: no scheduler answers" in done.stderr
    assert "Traceback" not in done.stderr


def dies(_model: Any, _item: int) -> int:
    os._exit(9)


def test_a_worker_that_is_lost_is_told_in_one_line(
    monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")
    address = request.getfixturevalue("scheduler")
    cluster = Cluster(address)
    try:
        with pytest.raises(EmulatorError, match=f"scheduler {address}: a worker .* ended"):
            list(cluster.map(dies, Number(3), [1, 2]))
    finally:
        cluster.close()


def test_an_address_that_cannot_be_is_wrong_usage(logs: list[str]) -> None:
    command = [sys.executable, "-m", "plant_emulator", "diagnose", "--model", "axis", *logs]
    command += ["--scheduler", "nonsense"]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("error: --scheduler nonsense: missing port number")
