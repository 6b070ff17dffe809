"""The unit for systemd, judged by systemd's own programs."""

import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

import gateway.cli


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "bench 1.toml"
    path.write_text("[plc]\nport = 502\n")
    return path


def install(*arguments: str | Path) -> tuple[int, str, str]:
    result = CliRunner().invoke(gateway.cli.main, ["install", *map(str, arguments)])
    return result.exit_code, result.stdout, result.stderr


def test_unit_runs_this_installation_with_this_configuration(config: Path) -> None:
    code, unit, _ = install("-c", config, "--print")
    assert code == 0
    (command,) = re.findall(r"^ExecStart=(.*)$", unit, flags=re.MULTILINE)
    assert shlex.split(command)[:6] == [sys.executable, "-m", "gateway", "run", "-c", str(config)]
    assert "Type=notify" in unit


def test_unit_is_written_and_the_next_step_told(config: Path, tmp_path: Path) -> None:
    code, told, _ = install("-c", config, "--to", tmp_path)
    assert code == 0
    assert (tmp_path / "gateway.service").read_text() == install("-c", config, "--print")[1]
    assert "systemctl" in told


def test_folder_that_is_not_there_and_bad_configuration_are_one_line(
    config: Path, tmp_path: Path
) -> None:
    code, _, told = install("-c", config, "--to", tmp_path / "missing")
    assert (code, told.count("\n")) == (1, 1)
    config.write_text("[plc]\nprt = 502\n")
    code, _, told = install("-c", config, "--print")
    assert (code, told.count("\n")) == (2, 1)


@pytest.mark.peer
def test_systemd_accepts_the_unit_and_finds_it_little_exposed(
    config: Path, tmp_path: Path, require_program: Callable[[str], str]
) -> None:
    """systemd rates from 0 (safe) to 10 (unsafe); a unit without hardening has 9.6."""
    install("-c", config, "--to", tmp_path)
    program, unit = require_program("systemd-analyze"), str(tmp_path / "gateway.service")
    verified = subprocess.run(
        [program, "verify", "--man=no", unit], capture_output=True, text=True, check=False
    )
    assert (verified.returncode, verified.stderr) == (0, "")
    rated = subprocess.run(
        [program, "security", "--offline=true", "--threshold=20", unit],
        capture_output=True,
        text=True,
        check=False,
    )
    assert rated.returncode == 0, rated.stdout[-300:]
