"""A user's own effect, from a file outside of the package."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from plant_emulator import effects, parameter_sets
from plant_emulator.cli import main
from plant_emulator.diagnosis.machines.bench import BenchRecipe
from plant_emulator.errors import ParameterError
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.solver import compiler
from plant_emulator.solver.kernel import build
from tests.plant_emulator.runs import linear, needs_compiler, simulate

ROOT = Path(__file__).parents[3]
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


def test_value_of_a_run_that_nothing_tells_needs_an_effect_of_one_size(tmp_path: Path) -> None:
    path = tmp_path / "oil_drag.py"
    phase = (
        '    "phase": EffectParameter(neutral=0.0, lower=-3.0, upper=3.0, plausible=0.0,\n'
        '        unit="rad", meaning="at the start", per_run=True),\n'
    )
    more = OIL_DRAG.replace('meaning="k"\n    )\n', f'meaning="k"\n    ),\n{phase}')
    path.write_text(more, encoding="utf-8")
    assert effects.from_file(path).name == "oil_drag"
    second = more.replace(phase, phase + phase.replace('"phase"', '"second"', 1)).replace(
        'plausible=0.0,\n        unit="rad", meaning="at the start", per_run=True),\n}',
        'plausible=1.0,\n        unit="rad", meaning="at the start"),\n}',
    )
    path.write_text(second, encoding="utf-8")
    with pytest.raises(ParameterError, match=r"oil_drag.*phase is each run's own.*not 2"):
        effects.from_file(path)


SIMULATED = """
import sys
from pathlib import Path
from plant_emulator import effects, parameter_sets
from plant_emulator.solver.kernel import kernel, use_own_effects
from tests.plant_emulator.runs import linear, simulate

use_own_effects(effects.from_file(Path(sys.argv[1])))
model = kernel()
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
        capture_output=True, text=True, check=True, timeout=500,
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


# --- a file with a mistake --------------------------------------------------------------------

FORCE = OIL_DRAG.replace("factor * speed", "BODY").replace("oil_drag", "own")


FOLLOWS = """from plant_emulator.effects import Memory

MEMORIES = {"oil": Memory(float, float, follows="ghost")}"""
BESIDE = FOLLOWS.replace("follows", "beside")


def written(folder: Path, text: str) -> Path:
    path = folder / "own.py"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("def drag(factor, speed):", "def drag(factor, speed)", 13, "expected ':'"),
        ("neutral=0.0", "neutral=1/0", 8, "ZeroDivisionError: division by zero"),
        ("neutral=0.0, ", "", 7, "TypeError: .*missing.*'neutral'"),
        ("import EffectParameter", "import EffectParametre", 3, "ImportError: .*EffectParametre"),
    ],
)
def test_mistake_in_the_file_is_told_with_its_line(
    tmp_path: Path, old: str, new: str, line: int, said: str
) -> None:
    path = written(tmp_path, FORCE.replace(old, new))
    with pytest.raises(ParameterError, match=rf"^{path}:{line}: {said}"):
        effects.from_file(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gear_torque = 3.0", r"gear_torque is no function of \(value, s, p\)"),
        (
            "def gear_torque(value, s):\n    return value",
            r"gear_torque is no function of \(value, s, p\)",
        ),
        ("PARAMETERS['other'] = 1.0", "PARAMETERS is no dict of names to EffectParameter"),
        ("MEMORIES = ['oil']", "MEMORIES is no dict of names to Memory"),
        (FOLLOWS, "memory oil follows 'ghost', which is no law; known: dead_time, .*flux"),
        (BESIDE, "memory oil is beside 'ghost', which is no other memory of the effect"),
    ],
)
def test_declaration_of_a_wrong_kind_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = written(tmp_path, f"{FORCE}\n\n{text}\n")
    with pytest.raises(ParameterError, match=rf"effect own: {path}: {said}"):
        effects.from_file(path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("neutral=0.0", 'neutral="0"', "parameter factor: neutral is '0'; a number is expected"),
        ("neutral=0.0", "neutral=-1.0", "parameter factor: neutral is -1; .* from 0 to 100"),
        ("plausible=20.0", "plausible=101.0", "parameter factor: plausible is 101; .* 0 to 100"),
        ("upper=100.0", "upper=float('inf')", "parameter factor: upper is inf; a finite number"),
        ("lower=0.0", "lower=200.0", "parameter factor: upper is 100; .* from 200 to inf"),
        (
            "neutral=0.0",
            "step=0.0, neutral=0.0",
            "parameter factor: step is 0; more than 0.01",
        ),
        ('"factor":', '"a factor":', "parameter a factor: another name is needed"),
        ('SUBSYSTEM = "gear"', 'SUBSYSTEM = "nonsense"', "SUBSYSTEM is 'nonsense'; one of drive,"),
    ],
)
def test_declaration_that_cannot_be_is_refused(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    path = written(tmp_path, FORCE.replace(old, new))
    with pytest.raises(ParameterError, match=rf"effect own: {path}: {said}"):
        effects.from_file(path)


def test_parameter_of_the_bench_is_not_declared_again(tmp_path: Path) -> None:
    path = tmp_path / "gear.py"
    path.write_text(OIL_DRAG.replace("factor", "inertia"), encoding="utf-8")
    with pytest.raises(ParameterError, match="gear_inertia cannot be used"):
        effects.from_file(path)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("2nd.py",), "'2nd' is no name in Python"),
        (("class.py",), "'class' is no name in Python"),
        (("stribeck.py",), "stribeck is one of the library"),
        (("a/drag.py", "b/drag.py"), "a/drag.py is called drag too"),
    ],
)
def test_name_that_cannot_be_is_refused_in_one_line(
    tmp_path: Path, names: tuple[str, ...], said: str
) -> None:
    command = ["diagnose", str(tmp_path / "run.csv")]
    for name in names:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(OIL_DRAG.replace("oil_drag", path.stem), encoding="utf-8")
        command += ["--effects", str(path)]
    result = CliRunner().invoke(main, command)
    (line,) = result.stderr.splitlines()
    assert (result.exit_code, result.stdout) == (2, "")
    assert line.startswith(f"error: {path}: ")
    assert said in line


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("p.own_fcator", "14: NameError: name 'p' is not defined"),
        ("factor.speed", "14: AttributeError: 'float' object has no attribute 'speed'"),
        ("'much'", "18: TypeError: .*'str'"),
        ("drag(factor, 0.5 * speed)", "14: RecursionError"),
        ("0.0 if speed == 0.0 else drag(factor, speed)", "13: drag calls itself"),
    ],
)
def test_mistake_in_a_law_is_told_with_its_line(tmp_path: Path, body: str, said: str) -> None:
    path = written(tmp_path, FORCE.replace("BODY", body))
    own = effects.from_file(path)
    with pytest.raises(ParameterError, match=rf"^{path}:{said}"):
        build({"own": own})


def test_misspelt_parameter_is_told_with_its_line(tmp_path: Path) -> None:
    path = written(tmp_path, FORCE.replace("p.own_factor", "p.own_fcator"))
    own = effects.from_file(path)
    with pytest.raises(ParameterError, match=rf"^{path}:18: .*no attribute 'own_fcator'"):
        build({"own": own})


def test_law_without_a_number_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, FORCE.replace("BODY", "0.0").replace("return value +", "value +"))
    own = effects.from_file(path)
    with pytest.raises(ParameterError, match=rf"^{path}:17: gear_torque gives no number"):
        build({"own": own})


ONLY_MOVING = "0.0 if speed == 0.0 else"


@pytest.mark.slow
@needs_compiler
def test_mistake_that_only_the_compiler_finds_is_told_with_its_line(tmp_path: Path) -> None:
    path = written(tmp_path, FORCE.replace("BODY", f"{ONLY_MOVING} factor.speed"))
    model = build({"own": effects.from_file(path)})
    with pytest.raises(ParameterError, match=rf"^{path}:14: Unknown attribute 'speed'"):
        simulate(linear((0.0, 0.0), duration=0.1), parameter_sets.load().values(), kernel=model)


def test_mistake_met_during_a_run_is_told_with_its_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiler, "ENABLED", False)
    path = written(tmp_path, FORCE.replace("BODY", f"{ONLY_MOVING} factor.speed"))
    model = build({"own": effects.from_file(path)})
    inputs = linear((0.0, 0.0), (0.5, 50.0), duration=0.5)
    with pytest.raises(ParameterError, match=rf"^{path}:14: AttributeError"):
        simulate(inputs, parameter_sets.load().values(), kernel=model)


def test_function_may_bear_the_name_of_a_field_that_it_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """s.gear_torque is the stage's, whatever functions of that name the file has."""
    monkeypatch.setattr(compiler, "ENABLED", False)
    text = FORCE.replace("BODY", "factor * speed").replace("value +", "value + 0 * s.gear_torque +")
    model = build({"own": effects.from_file(written(tmp_path, text))})
    inputs = linear((0.0, 0.0), (0.5, 50.0), duration=0.5)
    log = simulate(inputs, {**parameter_sets.load().values(), "own_factor": 5.0}, kernel=model)
    assert log["motor_speed"][-1] > 10.0


def test_a_recipe_with_an_edited_effect_is_another_one(
    nominal: ParameterSet, tmp_path: Path
) -> None:
    """A worker keeps the model of a recipe by its hash; the path alone would keep the old law."""
    path = tmp_path / "oil_drag.py"
    path.write_text(OIL_DRAG, encoding="utf-8")
    recipe = BenchRecipe((), nominal, own=(path,))
    before = recipe.digest()
    assert recipe.digest() == before
    path.write_text(OIL_DRAG.replace("factor * speed", "2.0 * factor * speed"), encoding="utf-8")
    assert recipe.digest() != before
