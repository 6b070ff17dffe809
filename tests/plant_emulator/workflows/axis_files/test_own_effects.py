"""A user's own effect of an axis: it is tested beside the library, and a faulty file is refused."""

from pathlib import Path

import numpy as np
import pytest

from plant_emulator import parameter_sets
from plant_emulator.errors import ParameterError
from plant_emulator.workflows.axis_files.own_effects import own_effects
from plant_emulator.workflows.diagnosis.diagnose import Diagnosis, diagnose
from tests.plant_emulator.diagnosis import axis_truth as truth

PULL = 600.0
CHAIN = '''"""The weight of a chain grows with the position squared.

F + p q^2, q the position
"""

from plant_emulator.diagnosis.axis.effects import Size

SUBSYSTEM = "load"
SIZES = (Size(name="pull", unit=("N/m^2", "N m/rad^2")),)


def columns(context, shapes):
    return (context.motion.position**2,)
'''


@pytest.fixture
def chain(tmp_path: Path) -> Path:
    path = tmp_path / "chain.py"
    path.write_text(CHAIN)
    return path


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    path = tmp_path_factory.mktemp("own") / "chain.py"
    path.write_text(CHAIN)
    logs = [
        truth.log(lambda q, v, a: PULL * q**2, phase=p, seed=k) for k, p in ((1, 0.0), (2, 1.0))
    ]
    return diagnose(logs[0], hold_out=logs[1], model="axis", effect_files=path)


@pytest.mark.slow
def test_an_own_effect_is_named_with_its_size(found: Diagnosis) -> None:
    assert found.answer.verdict.effects == ("chain",)
    (size,) = found.answer.ranking[0].parameters
    assert (size.name, size.unit) == ("chain_pull", "N/m^2")
    assert size.value == pytest.approx(PULL, rel=0.03)


@pytest.mark.slow
def test_the_set_of_an_axis_holds_its_parameters_and_its_effect(
    found: Diagnosis, tmp_path: Path
) -> None:
    expected = {
        "inertia": truth.MASS,
        "viscous_friction": truth.VISCOUS,
        "coulomb_friction": truth.COULOMB,
        "offset": truth.OFFSET,
    }
    kept = found.parameter_set
    assert kept.values() == pytest.approx(expected, rel=0.05)
    assert kept["inertia"].unit == "kg"
    assert kept.effects["chain"]["pull"] == pytest.approx(PULL, rel=0.03)
    parameter_sets.save(kept, tmp_path / "axis.toml")
    text = (tmp_path / "axis.toml").read_text()
    assert "[inertia]" in text
    assert 'model = "axis"' in text
    assert "chain.py" in text


@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        ("gravity", "", "", "'gravity' is one of the library"),
        ("my-chain", "", "", "'my-chain' is no name in Python"),
        ("chain", "SUBSYSTEM", "PLACE", "SUBSYSTEM, as in SUBSYSTEM = 'gear' is needed"),
        ("chain", "def columns", "def law", "SIZES and a function columns"),
        ("chain", "Size(name=", "dict(name=", "SIZES: .* a Size is needed"),
        ("chain", "SUBSYSTEM =", "SUBSYSTEM !", r"chain.py:8: "),
    ],
)
def test_a_faulty_file_is_refused(tmp_path: Path, name: str, old: str, new: str, told: str) -> None:
    path = tmp_path / f"{name}.py"
    path.write_text(CHAIN.replace(old, new))
    with pytest.raises(ParameterError, match=told):
        own_effects([path])


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="no Python file with an effect"):
        own_effects([tmp_path / "absent.py"])


@pytest.mark.parametrize(
    ("law", "told"),
    [
        ("(context.motion.position[1:],)", r"shape \(19999,\), all finite, is needed"),
        ("()", "0 columns; one a size, 1, is needed"),
        ("(context.motion.speed,)", r"chain.py:\d+: .*speed"),
    ],
)
def test_a_law_that_cannot_be_used_is_told_in_one_line(chain: Path, law: str, told: str) -> None:
    chain.write_text(CHAIN.replace("(context.motion.position**2,)", law))
    with pytest.raises(ParameterError, match=told):
        diagnose(
            truth.log(), hold_out=truth.log(phase=1.0, seed=2), model="axis", effect_files=chain
        )


def test_files_of_one_name_are_refused(tmp_path: Path) -> None:
    other = tmp_path / "other" / "chain.py"
    other.parent.mkdir()
    for path in (tmp_path / "chain.py", other):
        path.write_text(CHAIN)
    with pytest.raises(ParameterError, match="two files are called chain"):
        own_effects([tmp_path / "chain.py", other])


def test_a_replaced_force_needs_a_shape(tmp_path: Path) -> None:
    path = tmp_path / "late.py"
    path.write_text(
        '"""The force is late."""\n'
        "from plant_emulator.diagnosis.axis.effects import Shape\n"
        "SUBSYSTEM = 'drive'\n"
        "SHAPES = (Shape(name='time', unit=('s', 's'), lower=0.01, upper=0.1),)\n"
        "def replaced(force, time, shapes):\n"
        "    return force(time - shapes['time'])\n"
    )
    (late,) = own_effects([path])
    assert late.replaced is not None
    time = np.linspace(0.0, 1.0, 5)
    assert late.replaced(lambda t: 2.0 * t, time, {"time": 0.05}) == pytest.approx(2.0 * time - 0.1)
