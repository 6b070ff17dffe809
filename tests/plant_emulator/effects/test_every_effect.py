"""Conformance: what holds for every file in plant_emulator/effects."""

from collections.abc import Callable
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from plant_emulator import effects
from plant_emulator.errors import ParameterError
from plant_emulator.model import laws
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.stage import STAGE
from plant_emulator.signals.log import Log
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import simulate, values_of
from plant_emulator.solver.kernel import kernel, partial_kernel
from tests.plant_emulator.runs import linear

ReadLog = Callable[[str], Log]
SUBSYSTEMS = {
    "drive", "motor", "motor_shaft", "gear", "backlash_shaft", "drum", "torque_sensor",
    "speed_sensor", "wheel_contact",
}  # fmt: skip
RUNS = {
    "up, field weakening, stop": linear((0.2, 0.0), (2.2, 330.0), (4.0, 0.0), duration=5.0),
    "both directions": linear((0.2, 0.0), (0.8, 70.0), (1.8, -90.0), (2.6, 0.0), duration=3.5),
    "limits": linear((0.2, 0.0), (0.4, 480.0), (4.0, 480.0), (4.2, 100.0), duration=5.0),
}

every_effect = pytest.mark.parametrize("name", effects.names())


@pytest.fixture(scope="session")
def inputs(bench_log: ReadLog) -> dict[str, Log]:
    """Runs that excite what an effect may need: field weakening, reversal, limits, a truck."""
    truck = bench_log("bench_nominal/program6")
    first = slice(0, 801)
    signals = {key: signal[first] for key, signal in truck.signals.items()}
    return {**RUNS, "truck": Log(truck.time[first], signals, "truck")}


@pytest.fixture(scope="session")
def without(nominal: ParameterSet, inputs: dict[str, Log]) -> Callable[[str], Log]:
    """Return a function: name of a run -> the nominal simulation."""

    @cache
    def simulated(run: str) -> Log:
        return simulate(inputs_of(inputs[run]), nominal.values())

    return simulated


@every_effect
def test_effect_states_equation_and_source(name: str) -> None:
    description = effects.load(name).description
    assert "=" in description
    assert "Source" in description
    assert len(description.splitlines()[0]) < 90


@every_effect
def test_subsystem_is_of_the_vocabulary(name: str) -> None:
    assert effects.load(name).subsystem in SUBSYSTEMS


@every_effect
def test_bounds_contain_neutral_and_plausible(name: str) -> None:
    for key, parameter in effects.load(name).parameters.items():
        assert parameter.lower <= parameter.neutral <= parameter.upper, key
        assert parameter.lower <= parameter.plausible <= parameter.upper, key
        assert parameter.unit, key
        assert parameter.meaning, key


@every_effect
def test_some_parameter_differs_between_absent_and_plausible(name: str) -> None:
    assert any(p.neutral != p.plausible for p in effects.load(name).parameters.values())


@pytest.mark.parametrize("run", [*RUNS, "truck"])
@pytest.mark.parametrize("remembering", [True, False, None])
def test_effects_are_absent_at_their_neutral_values(
    remembering: bool | None, run: str, nominal: ParameterSet, inputs: dict[str, Log],
    without: Callable[[str], Log],
) -> None:  # fmt: skip
    """In the kernels that have them; by itself `simulate` leaves out an effect that is neutral."""
    model = kernel() if remembering is None else partial_kernel(remembering=remembering)
    found = simulate(inputs_of(inputs[run]), nominal.values(), kernel=model)
    for signal in found.signals:
        np.testing.assert_array_equal(found[signal], without(run)[signal])


def test_every_effect_is_in_one_of_the_kernels_with_a_part_of_them() -> None:
    parts = [{*partial_kernel(remembering=which).effects} for which in (True, False)]
    assert parts[0] | parts[1] == {*kernel().effects} == {*effects.names()}


@every_effect
def test_effect_of_plausible_size_shows_in_some_channel(
    name: str, nominal: ParameterSet, inputs: dict[str, Log], without: Callable[[str], Log]
) -> None:
    """By more than a tenth of a sensor's noise somewhere in some run."""
    noise = {"motor_speed": 0.15, "drum_speed": 0.01, "armature_current": 0.25,
             "shaft_torque": 0.25, "armature_voltage": 0.5}  # fmt: skip
    values = values_of(nominal, {name: effects.load(name).plausible()})
    changes = []
    for run, log in inputs.items():
        found = simulate(inputs_of(log), values)
        assert all(np.isfinite(signal).all() for signal in found.signals.values())
        changes += [np.abs(found[k] - without(run)[k]).max() / n for k, n in noise.items()]
    assert max(changes) > 0.1


@every_effect
def test_effect_leaves_a_bench_at_rest_at_rest(name: str, nominal: ParameterSet) -> None:
    values = values_of(nominal, {name: effects.load(name).plausible()})
    log = simulate(inputs_of(linear((0.0, 0.0), duration=1.0)), values)
    assert np.abs(log["motor_speed"]).max() < 1e-9
    assert np.abs(log["drum_speed"]).max() < 1e-9


@every_effect
def test_unknown_parameter_is_refused_with_the_known_ones(name: str) -> None:
    known = next(iter(effects.load(name).parameters))
    with pytest.raises(ParameterError, match=rf"ghost is no parameter of {name}.*{known}"):
        effects.parse([f"{name}:ghost=1"])


@every_effect
@pytest.mark.parametrize("value", ["1e99", "-1e99", "nan", "inf"])
def test_value_out_of_bounds_is_refused(name: str, value: str) -> None:
    key = next(iter(effects.load(name).parameters))
    with pytest.raises(ParameterError, match=rf"effect {name}: {key}=.* is allowed"):
        effects.parse([f"{name}:{key}={value}"])


@every_effect
def test_every_function_named_like_a_law_takes_value_stage_and_parameters(name: str) -> None:
    effect = effects.load(name)
    assert set(effect.laws) <= {law.__name__ for law in laws.LAWS}
    for function in effect.laws.values():
        assert function.__code__.co_argcount == 3


@every_effect
def test_memory_with_a_step_of_zero_keeps_its_value_or_is_without_inertia(
    name: str, nominal: ParameterSet
) -> None:
    effect = effects.load(name)
    neutral = {f"{name}_{key}": p.neutral for key, p in effect.parameters.items()}
    for memory in effect.memories.values():
        own = (f"{name}_{key}" for key in effect.memories)
        s = SimpleNamespace(**dict.fromkeys((*STAGE, *own), 0.0))
        p = SimpleNamespace(**{**nominal.values(), **neutral})
        value = () if memory.follows is None else (1.0,)
        value += () if memory.beside is None else (1.0,)
        assert np.isfinite(memory.start(p))
        assert np.isfinite(memory.advance(1.0, 1e-9, *value, s, p))


def test_all_effects_at_once_settle(nominal: ParameterSet, inputs: dict[str, Log]) -> None:
    """Each of plausible size; a stage that does not settle is refused by `simulate`."""
    values = values_of(nominal, {name: effects.load(name).plausible() for name in effects.names()})
    for log in inputs.values():
        found = simulate(inputs_of(log), values)
        assert all(np.isfinite(signal).all() for signal in found.signals.values())


# --- texts of the command line ----------------------------------------------------------------


def test_name_alone_takes_the_plausible_size() -> None:
    wanted = {"torque_sensor_lag": {"time_constant": 0.05, "second_order": 0.0}}
    assert effects.parse(["torque_sensor_lag"]) == wanted


def test_given_parameter_replaces_its_plausible_size_only() -> None:
    oil = effects.parse(["gear_oil_temperature:heat_capacity=2e5,start_temperature=283.15"])
    values = oil["gear_oil_temperature"]
    assert (values["heat_capacity"], values["start_temperature"]) == (2e5, 283.15)
    assert values["viscosity_coefficient"] == 0.02


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("torque_sensor_lga", "effect torque_sensor_lga: unknown; known: .*torque_sensor_lag"),
        ("torque_sensor_lag:time_constant=fast", "time_constant='fast'; a number is needed"),
        ("torque_sensor_lag:time_constant", "time_constant=''; a number is needed"),
        ("declaration", "effect declaration: unknown"),
    ],
)
def test_text_that_is_not_understood_is_refused(text: str, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        effects.parse([text])
