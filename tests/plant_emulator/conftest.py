"""The nominal bench and the logs of the independent one."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from plant_emulator import logs, parameter_sets
from plant_emulator.log import Log
from plant_emulator.parameters import ParameterSet

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture(scope="session")
def nominal() -> ParameterSet:
    """Table 3.1 of the thesis."""
    return parameter_sets.load("thesis_table_3_1")


@pytest.fixture(scope="session")
def bench_log() -> Callable[[str], Log]:
    """Return a function: path below tests/data without .csv.gz -> the log."""

    @cache
    def read(name: str) -> Log:
        return logs.read(DATA / f"{name}.csv.gz")

    return read
