"""Measure the cost of a diagnosis: the whole command, as an operator calls it."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import click

from plant_emulator import effects

ROOT = Path(__file__).resolve().parents[2]
CASE, CAUSE = ROOT / "tests/data/bench_practice/practice_003", "torque_sensor_lag"
SMALL = 10
LOGS = [str(CASE / f"program{k}.csv.gz") for k in (1, 2, 3)]


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Wall time from start to end of the process, and processor time of all processes [s]."""

    clock: float
    processors: float


def library(count: int) -> list[str]:
    """This many effects, evenly from the whole library; the cause in the logs is one of them."""
    others = [name for name in effects.names() if name != CAUSE]
    return [CAUSE, *(others[k * len(others) // (count - 1)] for k in range(count - 1))]


def diagnose(logs: int, count: int) -> Cost:
    """Run `plant-emulator diagnose` on this many logs with this many effects, and measure it.

    Raises ClickException for an answer that does not name the cause in the logs.
    """
    left_out = sorted(set(effects.names()) - set(library(count)))
    options = [word for name in left_out for word in ("--without", name)]
    before, started = _processors(), perf_counter()
    with TemporaryDirectory() as folder:
        file = Path(folder) / "answer.json"
        command = [sys.executable, "-m", "plant_emulator", "diagnose", *LOGS[:logs], *options]
        subprocess.run([*command, "--json", str(file)], cwd=ROOT, check=True, capture_output=True)
        cost = Cost(clock=perf_counter() - started, processors=_processors() - before)
        named = json.loads(file.read_text())["verdict"]["class"]
    if not any(CAUSE in names for names in named):
        raise click.ClickException(
            f"{logs} logs, {count} effects: {named} is named instead of {CAUSE}"
        )
    return cost


def cores() -> str:
    """The number of cores that a diagnosis uses, as words."""
    count = len(os.sched_getaffinity(0))
    return f"{count} core{'' if count == 1 else 's'}"


def _processors() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
