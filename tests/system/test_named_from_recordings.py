"""A bench that hides an effect, a sweep and a truck over the socket, and the diagnosis of both."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from rich.console import Console

from gateway.cli import main as gateway
from gateway.configuration.config import Config
from gateway.demo.gap import NOISE
from gateway.demo.operator import Session, operate_fast
from gateway.demo.view import Screen
from gateway.losses.live import sweep_config
from plant_emulator import effects, parameter_sets
from plant_emulator.cli import main as plant_emulator
from plant_emulator.emulator.process import EmulatorProcess
from plant_emulator.model.sensors import Sensor

pytestmark = pytest.mark.slow

# [rpm], each held for 3 s.
SPEEDS = (300.0, 900.0, 1800.0, 3000.0)


def bench_with(folder: Path, option: str) -> Path:
    """The file of a bench with this effect."""
    bench = folder / "bench.toml"
    sensors = {name: Sensor(noise=noise) for name, noise in NOISE.items()}
    hidden = effects.parse((option,))
    parameter_sets.save(replace(parameter_sets.load(), effects=hidden, sensors=sensors), bench)
    return bench


def swept(folder: Path, bench: Path) -> Path:
    """The recording of a sweep of this bench, without waiting for the clock."""
    with EmulatorProcess(parameters=str(bench), truck_mass=None, speed=None) as emulator:
        known = Config().with_values({"plc.port": str(emulator.port)})
        config = sweep_config(known, speeds=SPEEDS, hold=3.0)
        assert config.program is not None
        session = Session(
            config=config,
            file=folder / "sweep.toml",
            emulator=emulator,
            screen=Screen(Console(quiet=True), "", 1.0),
            duration=config.program.duration + 1.0,
        )
        return operate_fast(session).recording


def cycled(folder: Path, bench: Path) -> Path:
    """The recording of a truck's cycle on this bench, whose wheel torque nobody measures."""
    words = ["demo", "--fast", "--load", "0", "--driver", "pi", "--bench-parameters", str(bench)]
    driven = CliRunner().invoke(gateway, [*words, "--out", str(folder / "cycle")])
    assert driven.exit_code == 0, driven.output
    (recording,) = (folder / "cycle").glob("*.rlrec")
    return recording


def exported(recording: Path) -> str:
    """The log of a recording."""
    log = recording.with_suffix(".csv.gz")
    written = CliRunner().invoke(gateway, ["export", str(recording), "--to", str(log)])
    assert written.exit_code == 0, written.output
    return str(log)


@pytest.mark.parametrize(
    ("subsystem", "effect"),
    [
        ("gear", "gear_eccentricity"),
        ("motor", "motor_friction"),
        ("torque_sensor", "torque_sensor_offset:offset=0.7"),
        ("speed_sensor", "drum_speed_lag"),
    ],
)
def test_hidden_effect_is_named_from_recordings_alone(
    subsystem: str, effect: str, tmp_path: Path
) -> None:
    bench, answer = bench_with(tmp_path, effect), tmp_path / "gap.json"
    logs = [exported(record(tmp_path, bench)) for record in (swept, cycled)]
    words = ["diagnose", *logs, "--workers", "1", "--json", str(answer)]
    diagnosed = CliRunner().invoke(plant_emulator, words)
    assert diagnosed.exit_code == 0, diagnosed.output
    told = json.loads(answer.read_text())
    assert told["verdict"]["effects"] == [effect.partition(":")[0]]
    assert told["location"]["subsystem"] == subsystem
