"""tools/bench.py keeps its schema, and its peers solve the same bench."""

from __future__ import annotations

import json
import os
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plant_emulator import parameter_sets
from plant_emulator.signals.log import Log
from plant_emulator.simulation import programs
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import simulate

ROOT = Path(__file__).resolve().parents[2]
KEYS = {"name", "ours", "peer", "peers", "unit", "ratio", "target", "holds"}


def bench(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "tools/bench.py", *arguments],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_a_row_has_the_schemas_keys_and_its_verdict_follows_from_its_figures() -> None:
    found = bench("--only", "tick", "--json", "-")
    answer: dict[str, Any] = json.loads(found.stdout)
    assert answer["schema"] == "bench/1"
    assert [row["name"] for row in answer["rows"]] == ["tick_1", "tick_10"]
    for row in answer["rows"]:
        assert row.keys() >= KEYS
        assert row["ours"] > 0
        assert row["ratio"] == pytest.approx(row["peers"] / row["ours"])
        assert row["holds"] == (row["ratio"] >= row["target"])
    assert found.returncode == (0 if all(row["holds"] for row in answer["rows"]) else 1)


def test_a_row_that_does_not_exist_is_refused_with_the_names_that_do() -> None:
    found = bench("--only", "speed")
    assert found.returncode == 2
    assert "cvodes" in found.stderr
    assert found.stdout == ""


@pytest.mark.slow
def test_cvodes_is_compared_where_it_errs_as_we_do() -> None:
    found = bench("--only", "cvodes", "--json", "-")
    rows = json.loads(found.stdout)["rows"]
    assert [row["name"] for row in rows] == ["cvodes", "cvodes_simulate"]
    for row in rows:
        assert 0.0 < row["ours_error"] <= 0.015
        assert 0.0 < row["peers_error"] <= 1.25 * row["ours_error"]
        assert row["target"] == 8.0


@pytest.mark.slow
@pytest.mark.parametrize("style", ["plain", "tuned"])
def test_scipy_on_the_thesis_equations_agrees_with_the_simulation(style: str) -> None:
    program = programs.PROGRAMS["program1"]
    assert isinstance(program, programs.SpeedProgram)
    time, reference = program.reference()
    values = parameter_sets.load().values()
    ours = simulate(inputs_of(Log(time, {"speed_reference": reference})), values)
    peers = runpy.run_path(str(ROOT / "tools/benchmark/peers.py"))
    corners = ((0.0, 0.0), *program.corners, (program.duration, 0.0))
    theirs = peers["Lsoda"](time, peers[style](corners, values), values)(1e-5)
    for k, channel in enumerate(peers["CHANNELS"]):
        rms = np.sqrt(np.mean((ours[channel] - theirs[:, k]) ** 2))
        assert rms / np.ptp(theirs[:, k]) < 5e-4, channel
