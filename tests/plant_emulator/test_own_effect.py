"""A user's own effect, from a file outside of the package."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from plant_emulator import effects
from plant_emulator.errors import ParameterError

ROOT = Path(__file__).parents[2]
OIL_DRAG = '''"""Drag of the gear that rises with its speed: T = k omega_g. Source: a test."""

from plant_emulator.effects import EffectParameter

SUBSYSTEM = "gear"
PARAMETERS = {
    "factor": EffectParameter(
        neutral=0.0, lower=0.0, upper=100.0, plausible=20.0, unit="N m s/rad", meaning="k"
    )
}


def drag(factor, speed):
    return factor * speed


def gear_torque(value, s, p):
    return value + drag(p.oil_drag_factor, s.gear_speed)
'''


@pytest.fixture
def own(tmp_path: Path) -> effects.Effect:
    path = tmp_path / "oil_drag.py"
    path.write_text(OIL_DRAG, encoding="utf-8")
    return effects.from_file(path)


def test_file_is_read_as_an_effect(own: effects.Effect) -> None:
    assert (own.name, own.subsystem) == ("oil_drag", "gear")
    assert list(own.laws) == ["gear_torque"]
    assert own.plausible() == {"factor": 20.0}
    assert "T = k omega_g" in own.description


SIMULATED = """
import sys
from pathlib import Path
from plant_emulator import effects, parameter_sets
from plant_emulator.kernel import kernel
from tests.plant_emulator.runs import linear, simulate

model = kernel((effects.from_file(Path(sys.argv[1])),))
values = {**parameter_sets.load().values(), "oil_drag_factor": 20.0}
inputs = linear((0.5, 0.0), (3.0, 180.0), duration=30.0)
print(sorted(model.effects), simulate(inputs, values, kernel=model)["shaft_torque"][-1])
"""


@pytest.mark.slow
@pytest.mark.parametrize("process", ["first, compiling", "next, from the cache"])
def test_own_effect_acts_beside_the_shipped_ones(own: effects.Effect, process: str) -> None:
    answer = subprocess.run(
        [sys.executable, "-c", SIMULATED, own.file],
        env={**os.environ, "PYTHONPATH": str(ROOT)}, cwd=ROOT,
        capture_output=True, text=True, check=True, timeout=120,
    )  # fmt: skip
    names, _, torque = answer.stdout.rpartition(" ")
    assert names == str(sorted([*effects.names(), "oil_drag"]))
    omega = 180.0 / 62.6
    expected = 35.989 + 345.38 * omega**0.4418 + 20.0 * omega
    assert -62.6 * float(torque) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('SUBSYSTEM = "gear"', "", "declares no SUBSYSTEM"),
        ("PARAMETERS =", "SIZES =", "declares no PARAMETERS"),
        ("def gear_torque", "def gear_troque", "changes no law of the bench"),
    ],
)
def test_file_that_lacks_something_is_refused(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    path = tmp_path / "oil_drag.py"
    path.write_text(OIL_DRAG.replace(old, new), encoding="utf-8")
    with pytest.raises(ParameterError, match=said) as refusal:
        effects.from_file(path)
    assert "oil_drag" in str(refusal.value)


def test_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="no Python file with an effect"):
        effects.from_file(tmp_path / "ghost.py")


CONTRADICTION = '''"""A torque that is there while the gear turns without it. Source: a test."""

from plant_emulator.effects import EffectParameter

SUBSYSTEM = "gear"
PARAMETERS = {
    "size": EffectParameter(
        neutral=0.0, lower=0.0, upper=1e6, plausible=1e5, unit="N m", meaning="T"
    )
}


def gear_torque(value, s, p):
    return value + (p.contradiction_size if s.gear_speed > 0.1 else 0.0)
'''


def test_simulation_that_has_no_solution_is_refused_not_returned(tmp_path: Path) -> None:
    path = tmp_path / "contradiction.py"
    path.write_text(CONTRADICTION, encoding="utf-8")
    code = SIMULATED.replace("oil_drag_factor", "contradiction_size").replace("20.0", "1e7")
    code = code.replace("30.0", "3.0")
    result = subprocess.run(
        [sys.executable, "-c", code, str(path)],
        cwd=ROOT,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert result.returncode != 0
    assert "implicit stages did not settle" in result.stderr
