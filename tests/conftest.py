"""What every test may use: foreign programs, or a reason why the test skips."""

import os
import shutil
from collections.abc import Callable

import pytest

# Fixtures that take 10 s and more. All tests that use one of them run in the same process.
COSTLY = ("all_met", "diagnosed", "measured")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let the tests of a costly fixture follow each other in one worker."""
    for item in items:
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
