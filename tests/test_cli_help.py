"""Both command lines: help without heavy modules, one line and the right code for each error."""

import os
import subprocess
import sys

import click
import pytest
from click.testing import CliRunner, Result

import gateway.cli
import plant_emulator.cli
from gateway.errors import ConfigError, GatewayError

HEAVY = {"numba", "scipy", "pymodbus", "matplotlib", "numpy"}
FOLDERS = {"gateway": gateway.cli.main, "plant_emulator": plant_emulator.cli.main}
COMMANDS = [
    (package, name)
    for package, group in FOLDERS.items()
    for name in group.list_commands(click.Context(group))
]


def modules_loaded_by(*arguments: str) -> set[str]:
    """Top-level modules that `python -m ...` imports, by Python's own count."""
    run = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", *arguments],
        capture_output=True,
        text=True,
        check=True,
    )
    return {line.rpartition("|")[2].strip().partition(".")[0] for line in run.stderr.splitlines()}


@pytest.mark.parametrize("package", FOLDERS)
def test_help_loads_no_heavy_module(package: str) -> None:
    assert not modules_loaded_by(package, "--help") & HEAVY


@pytest.mark.parametrize(("package", "name"), COMMANDS)
def test_every_command_has_help_and_a_line_in_the_list(package: str, name: str) -> None:
    listing = CliRunner().invoke(FOLDERS[package], ["--help"]).stdout
    line = next(line for line in listing.splitlines() if line.split()[:1] == [name])
    assert len(line.split()) > 1
    helped = CliRunner().invoke(FOLDERS[package], [name, "--help"])
    assert helped.exit_code == 0
    assert "Usage:" in helped.stdout


@pytest.mark.parametrize("package", FOLDERS)
def test_version_is_told(package: str) -> None:
    assert "0.2.0" in CliRunner().invoke(FOLDERS[package], ["--version"]).stdout


@pytest.mark.parametrize("package", FOLDERS)
@pytest.mark.parametrize("arguments", [["nonsense"], ["--nonsense"]])
def test_wrong_usage_is_one_line_and_exit_code_2(package: str, arguments: list[str]) -> None:
    result = CliRunner().invoke(FOLDERS[package], arguments)
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1
    assert result.stderr.startswith("error: ")
    assert "nonsense" in result.stderr


@pytest.mark.parametrize("package", FOLDERS)
def test_no_command_shows_the_help_and_exits_with_2(package: str) -> None:
    result = CliRunner().invoke(FOLDERS[package], [])
    assert result.exit_code == 2
    assert "Commands:" in result.stderr


def outcome(package: str, error: BaseException) -> Result:
    """What the command line makes of a command that raises this error."""

    @click.command
    def fail() -> None:
        raise error

    group = type(FOLDERS[package])(name="group", package=f"{package}.cli")
    group.list_commands = lambda ctx: ["fail"]
    group.get_command = lambda ctx, name: fail
    return CliRunner().invoke(group, ["fail"])


@pytest.mark.parametrize("package", FOLDERS)
@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (GatewayError("it\nfailed"), 1, "error: it failed"),
        (
            ConfigError("too big", file="a.toml", place="loop.period_ms", value=3, expected="< 2"),
            2,
            "error: a.toml: loop.period_ms: too big, found 3; expected < 2",
        ),
        (FileNotFoundError(2, "No such file", "a.csv"), 2, "error: a.csv: No such file"),
        (OSError("no route"), 1, "error: no route"),
        (KeyboardInterrupt(), 130, "error: stopped"),
        (click.Abort(), 1, "error: stopped"),
    ],
)
def test_error_is_one_line_and_its_exit_code(
    package: str, error: BaseException, code: int, line: str
) -> None:
    result = outcome(package, error)
    assert result.exit_code == code
    assert result.stderr.strip() == line
    assert result.stdout == ""


@pytest.mark.parametrize("package", FOLDERS)
def test_our_own_mistake_is_not_hidden(package: str) -> None:
    mistake = ZeroDivisionError("ours")
    assert outcome(package, mistake).exception is mistake


@pytest.mark.parametrize("package", FOLDERS)
def test_reader_that_hung_up_gets_no_complaint(package: str) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as output:
        run = subprocess.run(
            [sys.executable, "-m", package, "--help"],
            stdout=output,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert run.stderr == ""
