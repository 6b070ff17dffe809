"""What the diagnosis of the gap costs: the whole command, as an operator calls it."""

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

ROOT = Path(__file__).resolve().parent.parent
CASE, CAUSE = ROOT / "tests/data/bench_practice/practice_003", "torque_sensor_lag"
SMALL = 10
LOGS = [str(CASE / f"program{k}.csv.gz") for k in (1, 2, 3)]


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Time on the clock, from the start of the process to its end, and of all processors [s]."""

    clock: float
    processors: float


def library(count: int) -> list[str]:
    """So many effects evenly from the whole library, the logs' own cause among them."""
    others = [name for name in effects.names() if name != CAUSE]
    return [CAUSE, *(others[k * len(others) // (count - 1)] for k in range(count - 1))]


def diagnosis(logs: int, count: int) -> Cost:
    """`plant-emulator diagnose` of so many logs with a library of so many effects, all cores.

    An answer that does not name the logs' own cause has no price: it ends the measurement.
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
        raise click.ClickException(f"{logs} logs, {count} effects: {CAUSE} not found, but {named}")
    return cost


def cores() -> str:
    """How many cores the diagnosis has."""
    count = len(os.sched_getaffinity(0))
    return f"{count} core{'' if count == 1 else 's'}"


def _processors() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
