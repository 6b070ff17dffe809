"""What every test may use: foreign programs, or a reason why the test skips."""

import os
import shutil
import subprocess
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.stalls import Stalls

# Fixtures that take 10 s and more. All tests that use one of them run in the same process.
COSTLY = ("all_effects", "diagnosed", "emps_told", "measured")

# A computer that runs tests may stop for longer than a gateway waits (another one borrows its
# processor). So a test bound to real time fails only when it fails this often, and when the
# computer kept time in one of these attempts. Else nothing is known, and the test skips.
ATTEMPTS = 3
STALL = 0.02
"""[s] Half of the time that a gateway waits for a reply."""
STALLS = pytest.StashKey[Stalls]()
KEPT_TIME = pytest.StashKey[bool]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--realtime",
        choices=("with", "without", "only"),
        default="with",
        help="run the tests bound to real time with the others, leave them out, or run only them",
    )


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave files without a test bound to real time unread where only such tests are wanted."""
    if config.getoption("--realtime") != "only" or collection_path.suffix != ".py":
        return None
    return None if "mark.realtime" in collection_path.read_text(encoding="utf-8") else True


@pytest.hookimpl(tryfirst=True)  # pytest-xdist reads the groups in its own hook
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Choose by real time; let the tests of a costly fixture follow each other in one worker."""
    wanted = config.getoption("--realtime")
    if wanted != "with":
        chosen = [
            (item.get_closest_marker("realtime") is None) == (wanted == "without") for item in items
        ]
        config.hook.pytest_deselected(
            items=[item for item, runs in zip(items, chosen, strict=True) if not runs]
        )
        items[:] = [item for item, runs in zip(items, chosen, strict=True) if runs]
    for item in items:
        if item.get_closest_marker("realtime"):
            item.add_marker(pytest.mark.flaky(reruns=ATTEMPTS - 1))
        for name in COSTLY:
            if name in getattr(item, "fixturenames", ()):
                item.add_marker(pytest.mark.xdist_group(name))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Measure from here on how late this computer wakes."""
    if item.get_closest_marker("realtime"):
        stash = item.config.stash
        stash[STALLS] = stash.get(STALLS, None) or Stalls()
        stash[STALLS].largest()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Skip a test bound to real time if the computer stopped in each attempt that failed."""
    report = yield
    if not item.get_closest_marker("realtime") or not report.failed or report.when == "teardown":
        return report
    stall = item.config.stash[STALLS].largest()
    item.stash[KEPT_TIME] = item.stash.get(KEPT_TIME, False) or stall < STALL
    if getattr(item, "execution_count", ATTEMPTS) >= ATTEMPTS and not item.stash[KEPT_TIME]:
        report.outcome = "skipped"
        reason = f"Skipped: this computer stopped for {1e3 * stall:.0f} ms in the last attempt"
        report.longrepr = (str(item.path), item.reportinfo()[1] or 0, reason)
    return report


def pytest_unconfigure(config: pytest.Config) -> None:
    """End the process that measures."""
    stalls = config.stash.get(STALLS, None)
    if stalls:
        stalls.close()


@pytest.fixture(autouse=True)
def end_processes(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> Iterator[None]:
    """End what a failed attempt in real time left: it would disturb the tests after it."""
    if not request.node.get_closest_marker("realtime"):
        yield
        return
    started: list[subprocess.Popen[Any]] = []

    class Kept(subprocess.Popen[Any]):
        def __init__(self, *arguments: Any, **options: Any) -> None:
            super().__init__(*arguments, **options)
            started.append(self)

    monkeypatch.setattr(subprocess, "Popen", Kept)
    yield
    for process in started:
        if process.poll() is None:
            process.kill()
            process.wait()


def pytest_report_header() -> str:
    """The processor whose code computes: the last bits of every figure depend on it."""
    import numpy as np  # noqa: F401 - loads the library
    from threadpoolctl import threadpool_info

    algebra = {one.get("architecture", one["internal_api"]) for one in threadpool_info()}
    compiled = os.environ.get("NUMBA_CPU_NAME", "this processor")
    return f"linear algebra of {', '.join(sorted(algebra))}; compiled for {compiled}"


def missing(reason: str) -> None:
    """Skip the test for this reason; where every peer has to be there (CI), fail it."""
    if os.environ.get("ROADLOAD_REQUIRE_PEERS") == "1":
        pytest.fail(reason, pytrace=False)
    pytest.skip(reason)


@pytest.fixture(scope="session")
def require_program() -> Callable[[str], str]:
    """Return a function: name of a program -> its path; the test skips where there is none."""

    def path_of(name: str) -> str:
        found = shutil.which(name)
        if found is None:
            missing(f"{name} is not installed")
        return str(found)

    return path_of
