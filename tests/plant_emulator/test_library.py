"""`import plant_emulator as pe`: what it offers, and that it costs nothing until it is used."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import plant_emulator as pe
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import simulate as simulate_run
from plant_emulator.simulation.simulate import values_of

ROOT = Path(__file__).parents[2]
HEAVY = {"numba", "scipy", "matplotlib", "numpy", "pymodbus", "click"}
LAG = "torque_sensor_lag"


def places_for_type_checkers() -> dict[str, tuple[str, str]]:
    """Public name -> (module, name there) of the imports that only type checkers see."""
    tree = ast.parse((ROOT / "plant_emulator" / "__init__.py").read_text("utf-8"))
    [guarded] = [node for node in tree.body if isinstance(node, ast.If)]
    return {
        alias.asname or alias.name: (str(node.module), alias.name)
        for node in guarded.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def same(one: pe.Log, other: pe.Log) -> bool:
    return one.signals.keys() == other.signals.keys() and all(
        np.array_equal(one[name], other[name]) for name in one.signals
    )


@pytest.mark.parametrize("name", pe.__all__)
def test_every_public_name_is_the_one_that_type_checkers_see(name: str) -> None:
    module, there = places_for_type_checkers()[name]
    found = getattr(pe, name)
    if name == "effects":
        assert found.__name__ == f"{module}.{there}"
    else:
        assert found is getattr(sys.modules[module], there)
    assert found.__doc__


def test_type_checkers_see_no_other_names() -> None:
    assert sorted(places_for_type_checkers()) == sorted(pe.__all__)
    assert set(dir(pe)) == set(pe.__all__)


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute"):
        pe.nonsense  # noqa: B018 - the access is what is tested


def test_import_loads_no_heavy_package() -> None:
    program = "import sys, plant_emulator as pe; dir(pe); print(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert not HEAVY & set(run.stdout.split())


def test_program_by_name_and_as_data_are_the_same_run() -> None:
    log = pe.simulate("program1")
    program = pe.PROGRAMS["program1"]
    assert same(log, pe.simulate(program))
    inputs = pe.Log(log.time, {"speed_reference": log["speed_reference"]})
    assert same(log, pe.simulate(inputs, start="middle"))
    given = values_of(pe.load_parameters())
    assert same(log, simulate_run(inputs_of(inputs), given))


def test_effect_without_value_has_its_plausible_size() -> None:
    size = pe.effects.load(LAG).parameters["time_constant"].plausible
    plausible = pe.simulate("program1", effects={LAG: {}})
    assert same(plausible, pe.simulate("program1", effects=LAG))
    assert same(plausible, pe.simulate("program1", effects=[LAG]))
    assert same(plausible, pe.simulate("program1", effects={LAG: {"time_constant": size}}))
    assert not same(plausible, pe.simulate("program1"))


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"ghost": {}}, "effect ghost: unknown"),
        ({LAG: {"ghost": 1.0}}, f"effect {LAG}: ghost is no parameter"),
        ({LAG: {"time_constant": -1.0}}, "time_constant=-1.0; 0 to"),
        ([f"{LAG}:time_constant=long"], "a number is needed"),
    ],
)
def test_effect_that_cannot_be_is_an_input_error(effects: object, message: str) -> None:
    with pytest.raises(pe.InputError, match=message):
        pe.simulate("program1", effects=effects)  # type: ignore[arg-type]


def test_log_is_followed_whether_read_or_named(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    pe.write_log(pe.simulate("program1", seed=3), path)
    by_path = pe.simulate(path)
    assert same(by_path, pe.simulate(str(path)))
    assert same(by_path, pe.simulate(pe.read_log(path)))
    assert by_path.source == str(path)


def test_seed_decides_the_noise() -> None:
    assert same(pe.simulate("program1", seed=1), pe.simulate("program1", seed=1))
    assert not same(pe.simulate("program1", seed=1), pe.simulate("program1", seed=2))


def test_set_that_was_saved_is_loaded_by_its_path(tmp_path: Path) -> None:
    heavier = pe.load_parameters().with_values({"drum_inertia": 340.0})
    pe.save_parameters(heavier, tmp_path / "mine.toml")
    mine = pe.load_parameters(tmp_path / "mine.toml")
    assert mine.value("drum_inertia") == 340.0
    assert same(
        pe.simulate("program1", parameters=tmp_path / "mine.toml"),
        pe.simulate("program1", parameters=mine),
    )


def test_what_is_shown_of_a_record_is_one_line() -> None:
    log = pe.simulate("program1")
    assert repr(log).startswith("<Log program1: 1851 samples, 18.5 s; speed_reference, ")
    assert repr(pe.load_parameters()) == "<ParameterSet thesis_table_3_1: 31 parameters>"
    assert (
        repr(pe.effects.load(LAG)) == f"<Effect {LAG} (torque_sensor): time_constant, second_order>"
    )
