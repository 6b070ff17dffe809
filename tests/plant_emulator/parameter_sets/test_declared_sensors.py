"""Declared sensors in the file of a parameter set: kept, or refused in one line."""

from dataclasses import replace
from pathlib import Path

import pytest

from plant_emulator import parameter_sets
from plant_emulator.errors import ParameterError
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.sensors import Sensor


def test_declared_sensors_survive_saving_and_other_values(
    nominal: ParameterSet, tmp_path: Path
) -> None:
    sensors = {
        "shaft_torque": Sensor(time_constant=0.02, noise=0.25),
        "drum_speed": Sensor(period=0.02),
    }
    bench = replace(nominal, sensors=sensors).with_values({"drum_inertia": 200.0})
    parameter_sets.save(bench, tmp_path / "bench.toml")
    assert parameter_sets.load(tmp_path / "bench.toml").sensors == sensors


@pytest.mark.parametrize(
    ("table", "told"),
    [
        (
            "[sensors.shaft_torque]\ntime_constant_s = -0.1",
            r"shaft_torque\.time_constant_s: -0\.1; a",
        ),
        ("[sensors.shaft_torque]\nperiod_s = nan", r"shaft_torque\.period_s: nan; a finite number"),
        ("[sensors.shaft_torque]\nnoise = 0", r"shaft_torque\.noise: 0; .* above 0 N m is needed"),
        ("[sensors.shaft_torque]\nnoise = true", r"noise: True; a finite number"),
        ("[sensors.shaft_torque]\nnoise = 'loud'", r"noise: 'loud'; a finite number"),
        ("[sensors.shaft_torque]\nlag = 1.0", r"shaft_torque\.lag: unknown key; known: time_const"),
        ("[sensors.wheel_torque]\nnoise = 1.0", r"wheel_torque: no such channel; known: shaft_t"),
        ("[sensors]\nshaft_torque = 0.1", r"sensors: one table a channel"),
    ],
)
def test_wrong_declaration_is_told_with_file_key_and_value(
    nominal: ParameterSet, tmp_path: Path, table: str, told: str
) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(f"{parameter_sets.text(nominal)}\n{table}\n", encoding="utf-8")
    with pytest.raises(ParameterError, match=rf"bench\.toml: .*{told}") as error:
        parameter_sets.load(path)
    assert "\n" not in str(error.value)
