"""What every test may use: foreign programs, or a reason why the test skips."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

# Fixtures that take 10 s and more. All tests that use one of them run in the same process.
COSTLY = ("all_effects", "diagnosed", "emps_told", "measured")

# A machine that runs tests may stop for longer than a gateway waits (another machine borrows its
# processor). So a test bound to real time fails only when it fails this often.
ATTEMPTS = 3


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


def pytest_report_header() -> str:
    """The processor whose code computes: the last bits of every figure depend on it."""
    import numpy as np  # noqa: F401  # loads the library
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
