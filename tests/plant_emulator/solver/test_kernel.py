"""Composition, compilation and cache of the kernel."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
import pytest

from plant_emulator import effects
from plant_emulator.errors import ParameterError
from plant_emulator.model import laws, stage
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import COMPARED
from plant_emulator.simulation.simulate import values_of
from plant_emulator.solver import compiler
from plant_emulator.solver.glue import glue
from plant_emulator.solver.kernel import (
    Kernel,
    build,
    kernel,
    kernel_for,
    partial_kernel,
    plain_kernel,
    use_own_effects,
)
from tests.plant_emulator.runs import linear, needs_compiler, simulate

ROOT = Path(__file__).parents[3]
INPUTS = linear((0.1, 0.0), (1.0, 220.0), (1.4, 220.0), (2.2, 0.0), duration=3.0)

UNCOMPILED = """
import json
from plant_emulator import parameter_sets
from plant_emulator.solver import compiler
from plant_emulator.simulation.running_bench import Bench
from plant_emulator.signals.log import COMPARED
from tests.plant_emulator.solver.test_kernel import INPUTS, simulate

values = parameter_sets.load().values()
lag = {**values, "torque_sensor_lag_time_constant": 0.1}
bench = Bench(parameter_sets.load())
samples = bench.advance([0.1 * k for k in range(300)], wheel_torque=50.0, brake_torque=20.0)
runs = [simulate(INPUTS, values), simulate(INPUTS, values, step=1e-3), simulate(INPUTS, lag)]
print(json.dumps({
    "compiler": compiler.ENABLED,
    "runs": [{name: run[name].tolist() for name in COMPARED} for run in runs],
    "bench": [samples.motor_speed.tolist(), samples.drum_speed.tolist()],
}))
"""


@pytest.mark.slow
def test_compiled_and_uncompiled_agree(nominal: ParameterSet) -> None:
    answer = subprocess.run(
        [sys.executable, "-c", UNCOMPILED],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)},
        cwd=ROOT, capture_output=True, text=True, check=True, timeout=120,
    )  # fmt: skip
    found = json.loads(answer.stdout)
    assert not found["compiler"]
    lag = values_of(nominal, {"torque_sensor_lag": {"time_constant": 0.1}})
    runs = [
        simulate(INPUTS, nominal.values()),
        simulate(INPUTS, nominal.values(), step=1e-3),
        simulate(INPUTS, lag),
    ]
    for plain, compiled in zip(found["runs"], runs, strict=True):
        for name in COMPARED:
            scale = np.ptp(compiled[name])
            np.testing.assert_allclose(plain[name], compiled[name], rtol=0.0, atol=1e-9 * scale)


def test_all_effects_at_their_neutral_values_leave_the_run_bit_for_bit(
    nominal: ParameterSet,
) -> None:
    bare = simulate(INPUTS, nominal.values(), kernel=build({}))
    composed = simulate(INPUTS, nominal.values(), kernel=kernel())
    assert len(kernel().effects) == len(effects.names()) >= 2
    for name in bare.signals:
        np.testing.assert_array_equal(bare[name], composed[name])


@needs_compiler
def test_switching_an_effect_on_compiles_nothing(nominal: ParameterSet) -> None:
    kernels = [kernel(), partial_kernel(remembering=True), partial_kernel(remembering=False)]
    for model in kernels:
        simulate(INPUTS, nominal.values(), kernel=model)

    def compiled() -> list[int]:
        return [len(model.run.__wrapped__.signatures) for model in kernels]  # type: ignore[attr-defined]

    assert compiled() == [1, 1, 1]
    for name in effects.names():
        plausible = {name: effects.load(name).plausible()}
        simulate(INPUTS, values_of(nominal, plausible))
    assert compiled() == [1, 1, 1]


AMPLIFIER = '''"""The torque amplifier: T (1 + e)."""

from plant_emulator.effects import EffectParameter

SUBSYSTEM = "torque_sensor"
PARAMETERS = {
    "error": EffectParameter(
        neutral=0.0, lower=-0.1, upper=0.1, plausible=0.01, unit="1", meaning="error"
    )
}


def measured_shaft_torque(value, s, p):
    return value * (1.0 + p.amplifier_error)
'''


def test_kernel_is_built_once_a_process() -> None:
    assert kernel() is kernel()


@pytest.mark.parametrize("name", effects.names())
def test_other_effects_that_are_not_there_change_no_bit(nominal: ParameterSet, name: str) -> None:
    """The least kernel with an effect against the one with all of them."""
    values = values_of(nominal, {name: effects.load(name).plausible()})
    assert kernel_for(values)[0] is not kernel()
    least, whole = simulate(INPUTS, values), simulate(INPUTS, values, kernel=kernel())
    for channel in whole.signals:
        np.testing.assert_array_equal(least[channel], whole[channel])


def test_least_kernel_with_the_effects_that_are_there(nominal: ParameterSet) -> None:
    """A lag has a memory, a gain has none; without either there is nothing but the bench."""
    assert kernel_for(nominal.values())[0] is plain_kernel()
    lag, gain = {"torque_sensor_lag_time_constant": 0.1}, {"torque_sensor_gain_error": 0.01}
    model, values = kernel_for({**nominal.values(), **dict.fromkeys([*lag, *gain], 0.0)})
    assert model is plain_kernel()
    assert values == nominal.values()
    assert kernel_for({**nominal.values(), **lag})[0] is partial_kernel(remembering=True)
    model, values = kernel_for({**nominal.values(), **gain, "torque_sensor_lag_time_constant": 0.0})
    assert model is partial_kernel(remembering=False)
    assert values == {**nominal.values(), **gain}
    assert kernel_for({**nominal.values(), **lag, **gain})[0] is kernel()


@pytest.mark.slow
def test_own_effect_alone_changes_the_same_bits_as_beside_the_library(
    nominal: ParameterSet, tmp_path: Path
) -> None:
    """A gain of a user's own, in the kernel without the library and in that with it."""
    file = tmp_path / "amplifier.py"
    file.write_text(AMPLIFIER, encoding="utf-8")
    use_own_effects(effects.from_file(file))
    try:
        values = {**nominal.values(), "amplifier_error": 0.01, "torque_sensor_gain_error": 0.0}
        least, whole = simulate(INPUTS, values), simulate(INPUTS, values, kernel=kernel())
        assert [*kernel_for(values)[0].effects] == ["amplifier"]
    finally:
        use_own_effects()
    for channel in whole.signals:
        np.testing.assert_array_equal(least[channel], whole[channel])
    library = simulate(INPUTS, {**nominal.values(), "torque_sensor_gain_error": 0.01})
    np.testing.assert_allclose(least["shaft_torque"], library["shaft_torque"], rtol=1e-9)


def test_value_of_no_effect_is_refused(nominal: ParameterSet) -> None:
    with pytest.raises(ParameterError, match="nonsense: neither a parameter"):
        simulate(INPUTS, {**nominal.values(), "nonsense": 1.0})


def test_effects_are_chained_in_the_order_of_the_list() -> None:
    lag, oil = effects.load("torque_sensor_lag"), effects.load("gear_oil_temperature")
    text = glue({"torque_sensor_lag": lag, "gear_oil_temperature": oil})
    assert "torque_sensor_lag__measured_shaft_torque(nominal_measured_shaft_torque(s, p)" in text
    assert "x[8] = s.torque_sensor_lag_shown" in text
    assert "x[10] = s.gear_oil_temperature_oil" in text
    taken = "nominal_measured_shaft_torque(s, p), base[9]"
    assert f"torque_sensor_lag_shown__advance(base[8], a, {taken}, s, p)" in text


def test_memory_takes_in_the_law_it_follows_as_the_effects_before_it_leave_it(
    nominal: ParameterSet, model_with: Callable[[str], Kernel]
) -> None:
    """A sensor that is 3 N m off, and then lags: at rest it shows 3 (1 - exp(-t / tau))."""
    lag = model_with(
        "def start(p):\n    return 0.0\n\n\n"
        "def advance(base, a, value, s, p):\n"
        "    return value + (base - value) * (p.own_size / (p.own_size + a))\n\n\n"
        "MEMORIES = {'shown': Memory(start, advance, follows='measured_shaft_torque')}\n\n\n"
        "def measured_shaft_torque(value, s, p):\n    return s.own_shown"
    )
    offset = model_with("def measured_shaft_torque(value, s, p):\n    return value + 3.0")
    before, after = offset.effects["own"], lag.effects["own"]
    model = build({"before": replace(before, name="before"), "own": after})
    rest = linear((0.0, 0.0), duration=0.3, period=1e-3)
    log = simulate(rest, {**nominal.values(), "own_size": 0.1}, kernel=model)
    expected = 3.0 * (1.0 - np.exp(-rest.time / 0.1))
    np.testing.assert_allclose(log["shaft_torque"], expected, atol=1e-3)


def test_glue_without_effects_is_the_nominal_model() -> None:
    text = glue({})
    assert text.count("return nominal_") == len(laws.LAWS)
    assert text.count("s.drum_speed = x[7]") == 1
    assert "__advance" not in text


def test_state_at_rest_holds_gap_and_start_temperature(nominal: ParameterSet) -> None:
    model = kernel()
    oil = {"gear_oil_temperature": {"start_temperature": 300.0}}
    p = model.parameter_record(values_of(nominal, oil))
    x = model.state(p, 0.1)
    assert x[stage.BACKLASH] == 0.1
    assert 300.0 in x[stage.FIRST_MEMORY :]
    assert not any(x[: stage.BACKLASH])
    assert x[stage.DRUM_SPEED] == 0.0


@pytest.fixture
def untouched_cache_folder() -> object:
    """The folder that numba keeps its results in is global: put it back afterwards."""
    folder = numba.config.CACHE_DIR
    yield
    numba.config.CACHE_DIR = folder


@needs_compiler
def test_cache_folder_follows_the_sources(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, untouched_cache_folder: object
) -> None:
    monkeypatch.setenv("ROADLOAD_CACHE", str(tmp_path / "cache"))
    source = tmp_path / "law.py"

    def folder(text: str, names: list[str]) -> str:
        source.write_text(text)
        compiler.use_cache([str(source)], names)
        return str(numba.config.CACHE_DIR)

    first = folder("a = 1", ["lag"])
    assert Path(first).parent == tmp_path / "cache"
    assert folder("a = 2", ["lag"]) != first
    assert folder("a = 1", ["lag", "oil"]) != first
    assert folder("a = 1", ["lag"]) == first


def test_cache_root_is_the_users_unless_told_otherwise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROADLOAD_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert compiler.cache_root() == tmp_path / "road-load-bench"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert compiler.cache_root() == Path.home() / ".cache" / "road-load-bench"
    monkeypatch.setenv("ROADLOAD_CACHE", str(tmp_path / "mine"))
    assert compiler.cache_root() == tmp_path / "mine"


COMPILING = """
from plant_emulator.solver import compiler

compiler.use_cache([], ["square"])

def square(x):
    return x * x

function = compiler.compile_function(square, on_disk=True)
assert function(3.0) == 9.0
print(sum(function.stats.cache_hits.values()))
"""


@needs_compiler
def test_of_two_processes_one_compiles_and_the_other_waits_for_it(tmp_path: Path) -> None:
    program = tmp_path / "square.py"
    program.write_text(COMPILING)
    both = [
        subprocess.Popen(
            [sys.executable, str(program)],
            env={**os.environ, "ROADLOAD_CACHE": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)},
            stdout=subprocess.PIPE, text=True,
        )
        for _ in range(2)
    ]  # fmt: skip
    assert sorted(one.communicate(timeout=120)[0].strip() for one in both) == ["0", "1"]
