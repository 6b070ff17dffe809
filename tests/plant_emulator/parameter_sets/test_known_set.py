"""The effects of a parameter set are known, or told in one line before anything is simulated."""

from dataclasses import replace
from math import inf
from pathlib import Path

import pytest

from plant_emulator import parameter_sets
from plant_emulator.errors import ParameterError
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.parameter_sets import with_effects

OWN = '''"""A factor on the torque that the gear loses."""

from plant_emulator.effects import EffectParameter

SUBSYSTEM = "gear"
PARAMETERS = {
    "factor": EffectParameter(
        neutral=0.0, lower=0.0, upper=1.0, plausible=0.2, unit="1", meaning="share"
    )
}


def gear_torque(value, s, p):
    return value * (1.0 + p.stiff_oil_factor)
'''


def saved(nominal: ParameterSet, folder: Path, **effects: dict[str, float]) -> str:
    path = folder / "bench.toml"
    parameter_sets.save(replace(nominal, effects=effects), path)
    return str(path)


def test_an_effect_that_nobody_knows_is_told_with_its_file(
    nominal: ParameterSet, tmp_path: Path
) -> None:
    path = saved(nominal, tmp_path, stiff_oil={"factor": 0.1})
    with pytest.raises(
        ParameterError, match=r"bench\.toml: effects\.stiff_oil: unknown; .*needs its file"
    ):
        with_effects.load(path)


def test_an_effect_of_ones_own_is_known_with_its_file(
    nominal: ParameterSet, tmp_path: Path
) -> None:
    own = tmp_path / "stiff_oil.py"
    own.write_text(OWN, encoding="utf-8")
    path = saved(nominal, tmp_path, stiff_oil={"factor": 0.1}, drum_imbalance={"moment": 3.0})
    assert with_effects.load(path, [str(own)]).effects["stiff_oil"] == {"factor": 0.1}


def test_a_misspelt_parameter_of_an_effect_is_told_with_those_known(
    nominal: ParameterSet, tmp_path: Path
) -> None:
    path = saved(nominal, tmp_path, torque_sensor_lag={"time_constants": 0.1})
    with pytest.raises(ParameterError, match=r"torque_sensor_lag\.time_constants: unknown; known:"):
        with_effects.load(path)


def test_an_error_that_is_infinite_is_left_out_of_the_file(
    nominal: ParameterSet, tmp_path: Path
) -> None:
    """TOML has no Infinity; a set written with it could not be read again."""
    drum = replace(nominal["drum_inertia"], standard_error=inf)
    own = replace(nominal, parameters={**nominal.parameters, "drum_inertia": drum})
    path = tmp_path / "bench.toml"
    parameter_sets.save(own, path)
    assert parameter_sets.load(str(path))["drum_inertia"].standard_error is None
