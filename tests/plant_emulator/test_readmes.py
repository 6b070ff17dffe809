"""The README files beside the code: their links, commands and library calls exist."""

import re
import shlex
from pathlib import Path

import click
import pytest

import plant_emulator as pe
from plant_emulator.cli import main

ROOT = Path(__file__).parents[2]
READMES = sorted((ROOT / "plant_emulator").rglob("README.md"))

every_readme = pytest.mark.parametrize(
    "readme", READMES, ids=[str(path.relative_to(ROOT)) for path in READMES]
)


def calls(text: str) -> list[list[str]]:
    """Arguments of every call of plant-emulator in the indented blocks."""
    joined = text.replace("\\\n", " ")
    lines = re.findall(r"^    \.venv/bin/plant-emulator (.*)$", joined, flags=re.MULTILINE)
    return [shlex.split(line) for line in lines]


@every_readme
def test_every_link_leads_to_a_file(readme: Path) -> None:
    links = re.findall(r"\]\(([^)#:]+)\)", readme.read_text("utf-8"))
    assert [link for link in links if not (readme.parent / link).exists()] == []


@every_readme
def test_every_named_file_of_the_package_exists(readme: Path) -> None:
    places = (readme.parent, ROOT / "plant_emulator", ROOT)
    names = re.findall(r"`([\w/]+(?:/|\.py))`", readme.read_text("utf-8"))
    assert [name for name in names if not any((place / name).exists() for place in places)] == []


@every_readme
def test_every_command_and_option_exists(readme: Path) -> None:
    context = click.Context(main)
    for name, *arguments in calls(readme.read_text("utf-8")):
        command = main.get_command(context, name)
        assert command is not None, name
        options = {text for parameter in command.params for text in parameter.opts}
        assert {text for text in arguments if text.startswith("--")} <= options, name


@every_readme
def test_every_library_name_exists(readme: Path) -> None:
    names = set(re.findall(r"\bpe\.(\w+)", readme.read_text("utf-8")))
    assert names <= set(dir(pe))


def test_readmes_of_bench_diagnosis_and_validation_are_there() -> None:
    found = {str(path.relative_to(ROOT / "plant_emulator")) for path in READMES}
    assert {"README.md", "diagnosis/README.md", "blind/README.md"} <= found
