"""Each example script runs as its docstring says, and what it prints can be told by hand."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import gateway

SCRIPTS = sorted((Path(gateway.__file__).parent / "examples").glob("*.py"))
LOG = Path(__file__).parents[1] / "data" / "bench_nominal" / "program6.csv.gz"


def run(name: str, *arguments: object) -> str:
    script = next(path for path in SCRIPTS if path.stem == name)
    words = [sys.executable, str(script), *map(str, arguments)]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_every_example_is_short_and_says_how_it_is_called(script: Path) -> None:
    text = script.read_text("utf-8")
    assert len(text.splitlines()) <= 40
    assert f"python {script.name}" in text


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_example_without_its_arguments_says_its_usage_in_one_line(script: Path) -> None:
    called = [sys.executable, str(script)]
    told = subprocess.run(called, capture_output=True, text=True, check=False)
    assert (told.returncode, told.stdout) == (2, "")
    assert re.fullmatch(rf"usage: python {script.name} LOG .+\n", told.stderr)


@pytest.mark.slow
def test_a_heavier_truck_gains_less_speed_from_the_same_torque() -> None:
    told = run("replay_with_another_mass", LOG, 0, 800, 1600)
    assert re.findall(r"(\d+) kg", told) == ["3640", "4440", "5240"]
    light, middle, heavy = map(int, re.findall(r"up to (\d+) rpm", told))
    assert light > middle > heavy
    assert "at most 0 rpm apart" in told.splitlines()[1]


@pytest.mark.slow
def test_the_log_of_the_thesis_regulator_is_closest_to_the_thesis_regulator(tmp_path: Path) -> None:
    told = run("compare_regulators", LOG, tmp_path / "regulators.png")
    thesis, compensated = (float(one) for one in re.findall(r"'val1': ([\d.]+)", told))
    assert thesis > 99.0 > compensated
    assert (tmp_path / "regulators.png").read_bytes().startswith(b"\x89PNG")
