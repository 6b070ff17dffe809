"""Steps on processes: the answers in their order, one line where a process is lost, none left."""

import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import pytest
from click.testing import CliRunner

from plant_emulator.cli import main
from plant_emulator.diagnosis.execution import pool
from plant_emulator.diagnosis.machine import Model
from plant_emulator.errors import EmulatorError, InputError
from plant_emulator.workflows.workers import Cluster, Processes


@dataclass
class Number:
    """A recipe whose model is a number."""

    value: int

    def build(self) -> Model:
        """See `Recipe`."""
        return cast("Model", self.value)

    def digest(self) -> str:
        """See `Recipe`."""
        return str(self.value)


def times(model: Any, item: int) -> int:
    return int(model * item)


def dies(_model: Any, _item: int) -> int:
    os._exit(9)


@pytest.mark.slow
def test_answers_come_in_the_order_of_the_items() -> None:
    workers = Processes(2)
    try:
        assert list(workers.map(times, Number(3), [1, 2, 3])) == [3, 6, 9]
    finally:
        workers.close()


def test_lost_process_is_told_in_one_line() -> None:
    workers = Processes(2)
    try:
        with pytest.raises(EmulatorError, match=r"2 processes ended.*fewer workers") as one:
            list(workers.map(dies, Number(3), [1, 2]))
        with pytest.raises(EmulatorError, match="one of 2 processes ended"):  # and it stays so
            list(workers.map(times, Number(3), [1, 2]))
    finally:
        workers.close()
    assert one.value.exit_code == 1


ROOT = Path(__file__).parents[3]
# Prints the number of the process of every worker, which then waits for work or computes for ever.
PARENT = f"""
from plant_emulator.workflows.workers import Processes
from {__name__} import Number, {{work}}
list(Processes(2).map({{work}}, Number(1), [1, 2]))
input()
"""


def waits(_model: Any, _item: int) -> None:
    os.write(1, b"%d\n" % os.getpid())


def computes(model: Any, item: int) -> None:
    waits(model, item)
    while True:
        pass


@pytest.mark.parametrize(
    ("work", "number"), [("computes", signal.SIGKILL), ("waits", signal.SIGTERM)]
)
def test_killed_parent_leaves_no_worker(work: str, number: signal.Signals) -> None:
    """Every worker holds the parent's standard output: it ends when the last process has ended."""
    command = [sys.executable, "-c", PARENT.format(work=work)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, cwd=ROOT, text=True, **pipes) as parent:
        assert parent.stdout is not None
        workers = {int(parent.stdout.readline()) for _ in range(2)}
        parent.send_signal(number)
        try:
            parent.communicate(timeout=10.0)
        except subprocess.TimeoutExpired:
            for worker in workers:
                os.kill(worker, signal.SIGKILL)
            raise
    assert parent.returncode == -number


class Cleared(dict[Any, Any]):
    """What another thread of the worker clears as soon as something stands there."""

    def __setitem__(self, key: Any, value: Any) -> None:
        super().__setitem__(key, value)
        self.clear()


def test_model_is_returned_though_another_thread_lets_it_go(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pool, "_MODELS", Cleared())
    model: Any = pool.build_model(Number(3))
    assert model == 3


@pytest.mark.parametrize("address", ["nonsense", "foo://host:1", "tcp://127.0.0.1:x", "tcp://"])
def test_address_that_cannot_be_is_wrong_usage(address: str) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match=f"scheduler {address}: .*tcp://host:8786"):
        Cluster(address)


@pytest.mark.parametrize(
    "option",
    [("--reference", "linear"), ("--next-program", "n.csv")],
)
def test_option_of_the_bench_is_refused_with_an_axis(option: tuple[str, str]) -> None:
    result = CliRunner().invoke(main, ["diagnose", "--model", "axis", "run.csv", *option])
    assert (result.exit_code, result.stdout) == (2, "")
    assert f"{option[0]} belongs to --model bench" in result.stderr
