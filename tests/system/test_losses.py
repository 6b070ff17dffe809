"""From a bench whose friction nobody knows to a truck that feels its road load, over the socket.

The bench's friction is the thesis's, 10 % up or down, and the regulator believes in Table 3.1: in
cruise the truck then feels about 30 % too little or too much. The sweep finds the friction; so does
whoever identifies the bench.
"""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from rich.console import Console

import plant_emulator
from gateway.cli import main
from gateway.configuration.config import Config
from gateway.demo.operator import Session, operate_fast
from gateway.demo.view import Screen
from gateway.losses.live import sweep_config
from plant_emulator.emulator.process import EmulatorProcess

pytestmark = pytest.mark.slow

THESIS = Path(plant_emulator.__file__).parent / "parameter_sets" / "thesis_table_3_1.toml"
# f_gc, f_g of Table 3.1
COULOMB, VISCOUS = 35.989, 345.38


def bench(folder: Path, share: float) -> Path:
    """The thesis's parameter set with that share of its friction."""
    text = THESIS.read_text().replace(f"value = {COULOMB}", f"value = {share * COULOMB!r}")
    file = folder / "bench.toml"
    file.write_text(text.replace(f"value = {VISCOUS}", f"value = {share * VISCOUS!r}"))
    return file


def gateway(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(one) for one in arguments])


def sweep(folder: Path, parameters: Path, period_ms: int, hold: float | None) -> Path:
    """The recording of a sweep of steady speeds, without waiting for the clock."""
    with EmulatorProcess(parameters=str(parameters), truck_mass=None, speed=None) as emulator:
        set_up = {"plc.port": str(emulator.port), "loop.period_ms": str(period_ms)}
        config = sweep_config(Config().with_values(set_up), speeds=None, hold=hold)
        assert config.program is not None
        session = Session(
            config=config,
            file=folder / "sweep.toml",
            emulator=emulator,
            screen=Screen(Console(quiet=True), "", 1.0),
            duration=config.program.duration + 1.0,
        )
        return operate_fast(session).recording


def cruise_error(folder: Path, parameters: Path, *options: object) -> float:
    """Error of the force in cruise over the road load; truck of 3640 kg with a driver.

    The driver keeps his speed however large the error of the force is.
    """
    out = folder / "demo"
    fixed = ("--fast", "--driver", "pi", "--load", 0, "--bench-parameters", parameters)
    shown = gateway("demo", "--out", out, *fixed, *options)
    assert shown.exit_code == 0, shown.output
    (run,) = json.loads((out / "summary.json").read_text())["runs"]
    assert run["truck_kg"] == 3640.0
    assert run["velocity"]["val1"] > 98.0
    return run["force"]["mean_error_newton"] / run["force"]["target_newton"]


@pytest.fixture(
    scope="module",
    params=[(1.1, 10, 3.0), (0.9, 20, None)],
    ids=["10 % up, held for 3 s", "10 % down, polled slowly"],
)
def measured(request, tmp_path_factory) -> tuple[float, Path, Path]:
    """Share of the thesis's friction, the bench's parameter set, the recording of its sweep."""
    share, period_ms, hold = request.param
    folder = tmp_path_factory.mktemp("bench")
    parameters = bench(folder, share)
    return share, parameters, sweep(folder, parameters, period_ms, hold)


def test_sweep_finds_the_friction_of_the_bench(measured, tmp_path):
    share, _, recording = measured
    answer = tmp_path / "losses.json"
    result = gateway("losses", recording, "--json", answer)
    assert result.exit_code == 0, result.output
    found = json.loads(answer.read_text())
    law = {name: entry["value"] for name, entry in found["friction"].items()}
    for omega in (0.5, 1.0, 2.0, 4.0, 6.0, 7.5):
        wanted = share * (COULOMB + VISCOUS * omega**0.4418)
        torque = law["coulomb"] + law["viscous"] * omega ** law["exponent"]
        assert torque == pytest.approx(wanted, rel=1e-3)
    assert len(found["sections"]) == 8


def test_its_map_gives_back_the_road_load(measured, tmp_path):
    share, parameters, recording = measured
    before = cruise_error(tmp_path / "before", parameters)
    file = tmp_path / "friction_map.toml"
    assert gateway("losses", recording, "--save", file).exit_code == 0
    after = cruise_error(tmp_path / "after", parameters, "--friction", file)
    print(f"friction x {share}: cruise force error {before:+.1%} -> {after:+.2%} with the map")
    assert 0.2 < abs(before) < 0.4
    assert abs(after) < 0.03


def test_so_does_a_parameter_set_and_a_recording_with_a_truck_is_refused(tmp_path):
    parameters = bench(tmp_path, 0.9)
    after = cruise_error(tmp_path, parameters, "--friction", parameters)
    print(f"cruise force error {after:+.2%} with the bench's parameter set")
    assert abs(after) < 0.03
    (recording,) = (tmp_path / "demo").glob("*.rlrec")
    refused = gateway("losses", recording, "--save", tmp_path / "map.toml")
    assert refused.exit_code == 2
    assert "was made in road load with a truck on the drum" in refused.stderr
    assert not (tmp_path / "map.toml").exists()


def test_recording_of_a_sweep_replays_bit_for_bit(measured):
    _, _, recording = measured
    result = gateway("replay", recording)
    assert result.exit_code == 0
    assert "equal bit for bit" in result.output
