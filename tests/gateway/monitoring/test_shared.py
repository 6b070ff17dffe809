"""Shared memory: who finds a daemon, and what is left of one that died."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from rich.console import Console

import gateway.cli
from gateway.cycle.supervisor import State
from gateway.monitoring import page, terminal
from gateway.monitoring.block import Values
from gateway.monitoring.shared import MAGIC, NotRunningError, Observer, Publisher, find
from tests.gateway.monitoring.identities import IDENTITY as BENCH
from tests.gateway.monitoring.test_block import good

IDENTITY = replace(BENCH, title="bench Ölprüfstand")
DYING = """
import os, signal, sys
from dataclasses import replace
from gateway.monitoring.shared import Publisher
from tests.gateway.monitoring.identities import IDENTITY
publisher = Publisher(replace(IDENTITY, pid=os.getpid(), title="another"))
print("ready", flush=True)
if "die" in sys.argv:
    os.kill(os.getpid(), signal.SIGKILL)
sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(tmp_path))
    return tmp_path


@pytest.fixture
def publisher() -> Iterator[Publisher]:
    with Publisher(IDENTITY) as made:
        yield made


@pytest.mark.parametrize("text", [b"no JSON", b"[]", b'{"pid": 1, "title": "half"}'])
def test_file_that_nobody_can_read_keeps_no_gateway_from_its_start(
    memory: Path, text: bytes
) -> None:
    foreign = memory / "gateway-1.status"
    foreign.write_bytes(MAGIC + text)
    with Publisher(IDENTITY) as made:
        assert find() == made.path
    assert not foreign.exists()


def another(*arguments: str) -> "subprocess.Popen[str]":
    process = subprocess.Popen(
        [sys.executable, "-c", DYING, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return process


def ended(process: "subprocess.Popen[str]") -> None:
    process.communicate("", timeout=20)


def test_observer_sees_what_was_published_and_who_published_it(publisher: Publisher) -> None:
    publisher(good(0))
    publisher(good(1))
    observer = Observer(find())
    assert observer.identity == IDENTITY
    assert observer.is_alive()
    assert observer.snapshot().values.motor_speed == 0.1
    publisher(good(2))
    assert observer.snapshot().values.ticks == 3


def test_no_gateway_is_one_line_and_exit_code_1(memory: Path) -> None:
    result = CliRunner().invoke(gateway.cli.main, ["watch"])
    assert result.exit_code == 1
    assert result.stderr == (
        f"error: {memory}: no gateway runs here; expected one that `gateway run` has started\n"
    )


def test_status_of_a_gateway_that_was_killed_is_not_found_and_the_next_one_removes_it(
    memory: Path,
) -> None:
    process = another("die")
    ended(process)
    assert process.returncode == -signal.SIGKILL
    assert len(list(memory.iterdir())) == 1
    with pytest.raises(NotRunningError):
        find()
    with Publisher(IDENTITY) as publisher:
        assert list(memory.iterdir()) == [publisher.path]
    assert list(memory.iterdir()) == []


def test_several_gateways_are_told_apart_by_their_process(publisher: Publisher) -> None:
    process = another()
    try:
        with pytest.raises(NotRunningError, match=f"--pid {process.pid}: another"):
            find()
        assert Observer(find(process.pid)).identity.title == "another"
        with pytest.raises(NotRunningError, match="no gateway of process 1 runs"):
            find(1)
    finally:
        ended(process)


def test_folder_that_is_not_there_is_told_by_its_name(
    memory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(memory / "missing"))
    with pytest.raises(Exception, match=r"missing/gateway.*No such file"):
        Publisher(IDENTITY)


def test_watch_writes_one_page_where_no_terminal_is(publisher: Publisher) -> None:
    """0.1 rad/s of the motor are 0.955 rpm; what is not measured is a dash."""
    publisher(good(0, State.ARMED))
    publisher(good(1))
    result = CliRunner().invoke(gateway.cli.main, ["watch"])
    assert result.exit_code == 0, result.output
    shown = result.output
    for part in (
        "bench Ölprüfstand",
        "RUN for 0 s",
        "1.0 rpm",
        "-12.80 Nm",
        "ARMED",
        "max 0.40 ms",
    ):
        assert part in shown
    (current,) = [line for line in shown.splitlines() if "armature current" in line]
    assert " - " in current


def test_page_calls_a_loop_that_stands_still_stalled(publisher: Publisher) -> None:
    publisher(good(0))
    values = Observer(find()).snapshot().values
    assert "STALLED" in dict(page.status_rows(values, 1.5))
    assert "STALLED" not in dict(page.status_rows(values, 0.5))


@pytest.mark.parametrize(
    ("done", "full", "told"),
    [(0.0, 0, "0 of 40 s"), (12.0, 9, "12 of 40 s"), (50.0, 30, "40 of 40 s")],
)
def test_program_shows_its_progress_while_it_runs(done: float, full: int, told: str) -> None:
    values = Values(now=100.0 + done, since=100.0, state=int(State.RUN))
    [(label, shown)] = page.progress_rows(values, 40.0)
    assert label == "program"
    assert shown.count(page.FULL) == full
    assert shown.endswith(f" {told}")
    assert page.progress_rows(values, None) == []
    assert page.progress_rows(replace(values, state=int(State.ARMED)), 40.0) == []


def test_trend_spans_its_values_and_leaves_holes() -> None:
    assert page.bars([0.0, 1.0, float("nan"), 7.0]) == "▁▂ █"
    assert page.bars([3.0, 3.0]) == "▁▁"
    assert page.bars([]) == ""


def test_changes_are_told_once_each_and_newest_last(publisher: Publisher) -> None:
    observer = Observer(find())
    publisher(good(0, State.ARMED))
    first = observer.snapshot()
    publisher(good(1))
    publisher(good(2))
    second = observer.snapshot()
    assert [line.split()[1] for line in terminal.new_lines(first, 0)] == ["ARMED"]
    assert [line.split()[1] for line in terminal.new_lines(second, 1)] == ["RUN"]
    assert terminal.new_lines(second, second.values.changes) == []


def test_page_fits_a_terminal_of_80_columns(publisher: Publisher) -> None:
    publisher(good(0))
    console = Console(width=80)
    snapshot, trend = Observer(find()).snapshot(), page.Trend()
    for _ in range(100):
        trend.add(snapshot.values)
    with console.capture() as capture:
        console.print(terminal.render(replace(IDENTITY, planned=1e4), snapshot, trend))
    assert max(map(len, capture.get().splitlines())) <= 80
