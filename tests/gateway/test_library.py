"""`import gateway` as a program calls it: light, lazy, and the same answer as the command."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import gateway
from gateway.cli import main

LOG = Path(__file__).parents[1] / "data" / "bench_nominal" / "program6.csv.gz"


def test_importing_the_library_loads_nothing_heavy() -> None:
    program = "import sys, gateway; dir(gateway); print(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert not {"numpy", "click", "pymodbus", "tomllib"} & set(run.stdout.split())


@pytest.mark.parametrize("name", gateway.__all__)
def test_every_name_of_the_library_is_there_and_documented(name: str) -> None:
    assert name in dir(gateway)
    assert getattr(gateway, name).__doc__


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match=r"'gateway' has no attribute 'reply'"):
        gateway.reply  # noqa: B018 - the access is what is tested


def test_the_library_answers_as_the_command_does() -> None:
    values = {"truck.load_kg": 1600, "regulator.name": "thesis"}
    result = gateway.replay(LOG, values=values)
    options = [word for key, value in values.items() for word in ("--set", f"{key}={value}")]
    answer = CliRunner().invoke(main, ["replay", str(LOG), "--json", "-", *options])
    assert json.loads(answer.stdout) == result.to_json()
    shown = CliRunner().invoke(main, ["replay", str(LOG), *options])
    assert shown.stdout == result.summary() + "\n"


def test_a_result_shows_itself_on_one_short_line() -> None:
    result = gateway.replay(str(LOG), config=gateway.Config(), values={"regulator.name": "thesis"})
    line = "<Replay of program6.csv.gz: 3640 kg, regulator thesis, 3001 samples, Val1 "
    assert repr(result).startswith(line)
    assert len(repr(result)) < 120


def test_a_configuration_may_be_a_file(tmp_path: Path) -> None:
    file = tmp_path / "bench.toml"
    file.write_text("[truck]\nmass_kg = 1000.0\n")
    assert gateway.replay(LOG, config=file).figures.truck_mass == 1000.0
    assert gateway.load_config(file).truck.mass == 1000.0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"truck.load_kg": -1.0}, r"truck\.load_kg: out of range, found -1\.0"),
        ({"truck.mass": 3640.0}, r"truck\.mass: unknown key"),
        ({"regulator.name": "none"}, r"regulator\.name: unknown regulator"),
    ],
)
def test_a_value_that_may_not_be_is_refused(values: dict[str, object], message: str) -> None:
    with pytest.raises(gateway.GatewayError, match=message):
        gateway.replay(LOG, values=values)


def test_a_file_that_is_not_there_is_an_error_of_the_gateway(tmp_path: Path) -> None:
    absent = tmp_path / "absent.csv"
    with pytest.raises(gateway.GatewayError, match=r"absent\.csv: No such file or directory"):
        gateway.replay(absent)


def test_a_shell_is_offered_the_public_names_only() -> None:
    assert dir(gateway) == sorted(gateway.__all__)
