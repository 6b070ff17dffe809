"""A set that names the file of an effect makes the effect known, wherever the two are moved."""

from dataclasses import replace
from pathlib import Path
from shutil import copy

import pytest

from plant_emulator import effects, parameter_sets
from plant_emulator.errors import ParameterError
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.parameter_sets import with_effects

TEXT = '''"""A torque that nobody knew of."""

from plant_emulator.effects import EffectParameter

SUBSYSTEM = "gear"
PARAMETERS = {
    "size": EffectParameter(
        neutral=0.0, lower=-9.0, upper=9.0, plausible=2.0, unit="N m", meaning="size"
    )
}


def gear_torque(value, s, p):
    return value + p.new_torque_size
'''


@pytest.fixture
def saved(tmp_path: Path, nominal: ParameterSet, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A saved set with an effect of its own; the process forgets the effect at the end."""
    monkeypatch.setattr(effects, "_of_sets", {})
    file = tmp_path / "drafts" / "new_torque.py"
    file.parent.mkdir()
    file.write_text(TEXT)
    known = replace(
        nominal, effects={"new_torque": {"size": 1.5}}, effect_files={"new_torque": str(file)}
    )
    parameter_sets.save(known, tmp_path / "bench.toml")
    return tmp_path / "bench.toml"


def test_loaded_set_makes_its_effect_known(saved: Path) -> None:
    with pytest.raises(ParameterError):
        effects.load("new_torque")
    assert with_effects.load(saved).effects == {"new_torque": {"size": 1.5}}
    assert effects.load("new_torque").subsystem == "gear"


def test_set_and_file_may_move_together(saved: Path, tmp_path: Path) -> None:
    other = tmp_path / "elsewhere"
    (other / "drafts").mkdir(parents=True)
    copy(saved, other / "bench.toml")
    copy(tmp_path / "drafts" / "new_torque.py", other / "drafts")
    (tmp_path / "drafts" / "new_torque.py").unlink()
    found = with_effects.load(other / "bench.toml")
    assert effects.load("new_torque").file == str(other / "drafts" / "new_torque.py")
    assert Path(found.effect_files["new_torque"]) == other / "drafts" / "new_torque.py"


def test_missing_file_is_told_with_its_path(saved: Path, tmp_path: Path) -> None:
    (tmp_path / "drafts" / "new_torque.py").unlink()
    with pytest.raises(ParameterError, match=r"new_torque\.py: no Python file"):
        with_effects.load(saved)
