"""The page "Diagnose your own machine": its commands, run as they stand there."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from plant_emulator.cli import main

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "plant_emulator" / "diagnosis" / "OWN_MACHINE.md"
COMMAND = re.compile(r"    \.venv/bin/plant-emulator (.*)")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the example of the page wrote its logs."""
    found = tmp_path_factory.mktemp("own")
    script = ROOT / "plant_emulator" / "examples" / "own_machine_logs.py"
    subprocess.run([sys.executable, script], cwd=found, check=True, capture_output=True)
    return found


def commands() -> list[list[str]]:
    joined = re.sub(r"\\\n\s*", " ", PAGE.read_text("utf-8"))
    return [shlex.split(line) for line in COMMAND.findall(joined)]


@pytest.mark.slow
def test_the_first_command_finds_the_weight_of_the_arm(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    result = CliRunner().invoke(main, [*commands()[0], "--json", "a.json"])
    assert result.exit_code == 0, result.output
    answer = json.loads(Path("a.json").read_text("utf-8"))
    assert answer["verdict"]["effects"] == ["gravity"]
    [weight] = [
        size
        for size in answer["ranking"][0]["parameters"]
        if size["name"].endswith("cosine") and size["unit"] == "N m"
    ]
    # 0.9 N m in the script
    assert abs(weight["value"] - 0.9) < 3.0 * weight["standard_error"] < 0.01
    [shown] = re.findall(r"```text\n(EFFECT FOUND.*?)```", PAGE.read_text("utf-8"), flags=re.DOTALL)
    assert result.stdout.startswith(shown)
    assert "<html" in Path("arm.html").read_text("utf-8")


@pytest.mark.slow
def test_the_other_command_predicts_a_part_of_the_log(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    result = CliRunner().invoke(main, [*commands()[1], "--json", "-"])
    assert result.exit_code == 0, result.output
    held_out = json.loads(result.stdout)["logs"]["held_out"]
    assert held_out == ["run1.csv@12.5:20"]


def test_the_page_shows_the_head_of_the_example(folder: Path) -> None:
    head = (folder / "run1.csv").read_text("utf-8").splitlines()[:4]
    assert "\n".join(head) in PAGE.read_text("utf-8")
