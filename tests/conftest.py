"""What every test may use: foreign programs and recorded data, or a reason why the test skips."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


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


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of the recorded data, which is not part of the repository: REAL_DATA names it."""
    folder = ROOT / os.environ.get("REAL_DATA", "../shared/data")
    if not folder.is_dir():
        pytest.skip(f"no recorded data at {folder}; REAL_DATA names its folder")
    return folder
