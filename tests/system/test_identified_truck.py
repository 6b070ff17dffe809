"""From road logs to the gateway, whose configuration accepts the saved truck."""

import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

import gateway.cli
import plant_emulator.cli
from gateway.config_file import load
from gateway.physics.road_load import road_load

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data" / "road_practice"
CRR = 0.009924
"""True rolling resistance of road_2 (labels.tsv)."""


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("truck") / "truck.toml"
    logs = [str(DATA / f"road_2_{channel}.csv.gz") for channel in ("torque", "velocity")]
    arguments = ["identify-truck", *logs, "--mass", "5240", "--save", str(path)]
    result = CliRunner().invoke(plant_emulator.cli.main, arguments)
    assert result.exit_code == 0, result.output
    return path


@pytest.mark.slow
def test_saved_truck_is_a_configuration_that_holds(saved: Path) -> None:
    result = CliRunner().invoke(gateway.cli.main, ["check", "-c", str(saved)])
    assert result.exit_code == 0, result.output


@pytest.mark.slow
def test_gateway_asks_for_the_identified_force(saved: Path) -> None:
    """5240 kg * 9.81 m/s^2 * C_rr = 510.1 N, at 1 m/s within 1 % of the label."""
    config = load(saved)
    assert config.truck.total_mass == 5240.0
    force = road_load(config.truck, config.bench).force(1.0)
    assert force == pytest.approx(5240.0 * 9.81 * CRR, rel=0.01)


def test_saved_table_pasted_over_the_examples_truck_is_taken(saved: Path, tmp_path: Path) -> None:
    example = (ROOT / "gateway" / "examples" / "bench.toml").read_text("utf-8")
    head, rest = example.split("[truck]")
    pasted = tmp_path / "bench.toml"
    tail = "\n[regulator]" + rest.split("[regulator]")[1]
    pasted.write_text(head + saved.read_text("utf-8") + tail)
    config = load(pasted)
    assert config.truck.f0 == tomllib.loads(saved.read_text("utf-8"))["truck"]["f0_N"]
    assert config.regulator.name == "compensated"
