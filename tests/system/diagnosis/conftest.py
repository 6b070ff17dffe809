"""One diagnosis of real logs by the command, for all tests of what it writes."""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from plant_emulator import effects

# Logs of the independent bench with a torque sensor that lags by 0.1 s (tests/data/README.md).
CASE = Path(__file__).parents[2] / "data" / "bench_practice" / "practice_003"
FITTED = [str(CASE / f"program{k}.csv.gz") for k in (1, 2)]
PREDICTED = str(CASE / "program3.csv.gz")
# A small library: what each further effect costs is measured elsewhere.
LIBRARY = {"torque_sensor_lag", "torque_sensor_offset", "stribeck", "drum_bearing_friction"}
LEFT_OUT = sorted({*effects.names()} - LIBRARY)


@dataclass(frozen=True, kw_only=True)
class Diagnosed:
    """What the command wrote, and what it said."""

    answer: dict[str, Any]
    terminal: str
    errors: str
    report: Path
    saved: Path


def without(names: list[str]) -> list[str]:
    """The options that take these effects out of the library."""
    return [word for name in names for word in ("--without", name)]


def plant_emulator(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """The command, ended and kept whatever its exit code."""
    command = [sys.executable, "-m", "plant_emulator", *map(str, arguments)]
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=500)


@pytest.fixture(scope="session")
def diagnosed(tmp_path_factory: pytest.TempPathFactory) -> Diagnosed:
    """Programs 1 and 2 diagnosed, program 3 held out, everything written that can be."""
    folder = tmp_path_factory.mktemp("diagnosed")
    answer, report, saved = folder / "gap.json", folder / "gap.html", folder / "bench.toml"
    outputs = ["--json", answer, "--report", report, "--save", saved]
    done = plant_emulator(
        "diagnose", *FITTED, "--hold-out", PREDICTED, *without(LEFT_OUT), *outputs
    )
    assert done.returncode == 0, done.stderr
    return Diagnosed(
        answer=json.loads(answer.read_text()),
        terminal=done.stdout,
        errors=done.stderr,
        report=report,
        saved=saved,
    )
