"""A diagnosis on a Dask cluster: a scheduler and two workers, each a process of its own."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from plant_emulator import parameter_sets, read_log
from plant_emulator.cli import main
from plant_emulator.diagnosis.execution.pool import InProcess
from plant_emulator.diagnosis.fitting.fit_steps import start
from plant_emulator.diagnosis.machines.bench import BenchRecipe
from plant_emulator.errors import EmulatorError
from plant_emulator.recordings.recording import recording
from plant_emulator.workflows.workers import Cluster
from tests.plant_emulator.workflows.test_workers import Number
from tests.system.diagnosis.conftest import FITTED, LEFT_OUT

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
def log(tmp_path: Path) -> str:
    file = tmp_path / "run.csv"
    rows = [f"{0.001 * n:.3f},{n * n * 1e-6},{n % 7}" for n in range(2000)]
    file.write_text("\n".join(["time_s,position_m,force_N", *rows, ""]))
    return str(file)


def test_steps_of_a_diagnosis_find_on_a_cluster_what_one_process_finds(scheduler: str) -> None:
    recordings = tuple(recording(read_log(path)) for path in FITTED)
    recipe = BenchRecipe(recordings, parameter_sets.load("thesis_table_3_1"), tuple(LEFT_OUT))
    fitted: list[tuple[int, ...]] = [(0,), (1,)]
    alone = list(InProcess().map(start, recipe, fitted))
    cluster = Cluster(scheduler)
    try:
        found = list(cluster.map(start, recipe, fitted))
    finally:
        cluster.close()
    assert all(fit.converged for fit, _ in found)
    assert found[0] != found[1]
    assert found == alone


def test_a_scheduler_that_does_not_answer_is_told(log: str) -> None:
    command = [sys.executable, "-m", "plant_emulator", "diagnose", "--model", "axis", log]
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


def test_an_address_that_cannot_be_is_wrong_usage(log: str) -> None:
    command = ["diagnose", "--model", "axis", log, "--scheduler", "nonsense"]
    done = CliRunner().invoke(main, command)
    assert done.exit_code == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("error: --scheduler nonsense: missing port number")
