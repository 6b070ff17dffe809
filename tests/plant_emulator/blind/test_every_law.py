"""Conformance: claims that hold for every law in plant_emulator/blind/laws."""

import numpy as np
import pytest

from plant_emulator import effects
from plant_emulator.blind import laws
from plant_emulator.blind.catalogue import INSIDE, OUTSIDE
from plant_emulator.effects import Effect
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import COMPARED, Log
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import SENSORS
from plant_emulator.simulation.simulate import simulate, values_of
from plant_emulator.solver.kernel import kernel
from tests.plant_emulator.runs import linear, with_truck

UP = linear((0.2, 0.0), (2.2, 330.0), (4.0, 0.0), duration=5.0)
RUNS = {
    "up, field weakening, stop": UP,
    "both directions": linear((0.2, 0.0), (0.8, 70.0), (1.8, -90.0), (2.6, 0.0), duration=3.5),
    "limits": linear((0.2, 0.0), (0.4, 480.0), (4.0, 480.0), (4.2, 100.0), duration=5.0),
    "long": linear((0.2, 0.0), (2.2, 100.0), (40.0, 100.0), duration=40.0),
    "truck": with_truck(UP, np.where(UP.time > 0.3, 300.0 * np.sin(5.0 * UP.time), 0.0)),
}
OTHER_LAW = [entry for entry in INSIDE if entry.effect != entry.law]

every_law = pytest.mark.parametrize("name", laws.names())


def size(found: Log, other: Log) -> float:
    """Norm of the difference of two logs over the sensor noise."""
    return float(
        np.sqrt(sum(np.sum(((found[c] - other[c]) / SENSORS[c][0]) ** 2) for c in COMPARED))
    )


def _law(name: str) -> Effect:
    return laws.load(name) if name in laws.names() else effects.load(name)


def _plausible(name: str) -> dict[str, float]:
    return _law(name).plausible()


@pytest.fixture(scope="module")
def nominals(nominal: ParameterSet) -> dict[str, Log]:
    return {name: simulate(inputs_of(run), nominal.values()) for name, run in RUNS.items()}


@pytest.mark.parametrize("run", RUNS)
def test_laws_are_absent_at_their_neutral_values(
    run: str, nominal: ParameterSet, nominals: dict[str, Log]
) -> None:
    """In the kernel with all of them. Alone, `simulate` would leave out a law that is neutral."""
    found = simulate(inputs_of(RUNS[run]), nominal.values(), kernel=kernel())
    assert {*kernel().effects} >= {*laws.names()}
    for signal in found.signals:
        np.testing.assert_array_equal(found[signal], nominals[run][signal])


@every_law
def test_law_of_plausible_size_shows(
    name: str, nominal: ParameterSet, nominals: dict[str, Log]
) -> None:
    values = values_of(nominal, {name: _plausible(name)})
    found = {run: simulate(inputs_of(log), values) for run, log in RUNS.items()}
    assert max(size(found[run], nominals[run]) for run in RUNS) > 0.5


@pytest.mark.parametrize("entry", OTHER_LAW, ids=lambda entry: entry.law)
def test_law_differs_from_that_of_the_library_at_any_size(
    entry: object, nominal: ParameterSet, nominals: dict[str, Log]
) -> None:
    """The part orthogonal to the library's change exceeds 1 % of the change, or the noise."""
    law, effect = entry.law, entry.effect  # type: ignore[attr-defined]
    ours = values_of(nominal, {law: _plausible(law)})
    theirs = values_of(nominal, {effect: _plausible(effect)})
    parts = []
    for run, log in RUNS.items():
        both = [simulate(inputs_of(log), values) for values in (ours, theirs)]
        changes = [
            np.concatenate([(f[c] - nominals[run][c]) / SENSORS[c][0] for c in COMPARED])
            for f in both
        ]
        parts.append(changes)
    a, b = (np.concatenate(column) for column in zip(*parts, strict=True))
    orthogonal = a - b * (a @ b) / (b @ b)
    assert np.linalg.norm(orthogonal) > min(0.01 * float(np.linalg.norm(a)), 10.0)


@every_law
def test_law_states_equation_and_source(name: str) -> None:
    description = laws.load(name).description
    assert "=" in description
    assert "Source" in description


@every_law
def test_law_is_not_in_the_library(name: str) -> None:
    assert name not in effects.names()


@every_law
def test_law_leaves_a_bench_at_rest_at_rest(name: str, nominal: ParameterSet) -> None:
    values = values_of(nominal, {name: _plausible(name)})
    log = simulate(inputs_of(linear((0.0, 0.0), duration=1.0)), values)
    assert np.abs(log["motor_speed"]).max() < 1e-9


def test_every_effect_of_the_library_may_be_hidden() -> None:
    assert sorted(entry.effect for entry in INSIDE) == effects.names()


def test_library_law_is_used_only_where_there_is_no_other() -> None:
    """Constant and proportional sensor errors and the weight of an imbalance have one law only."""
    same = {entry.effect for entry in INSIDE if entry.effect == entry.law}
    assert same == {
        "torque_sensor_offset", "torque_sensor_gain", "drum_speed_scale", "motor_speed_scale",
        "drum_imbalance",
    }  # fmt: skip


def test_every_law_is_hidden_by_one_entry() -> None:
    used = [entry.law for entry in (*INSIDE, *OUTSIDE)]
    assert sorted(set(used) - set(effects.names())) == laws.names()
    assert len(used) == len(set(used))


def test_at_least_five_effects_lie_outside_the_library() -> None:
    assert len(OUTSIDE) >= 5
    assert not {entry.effect for entry in OUTSIDE} & set(effects.names())


@pytest.mark.parametrize("entry", [*INSIDE, *OUTSIDE], ids=lambda entry: entry.effect)
def test_law_sits_where_its_effect_sits(entry: object) -> None:
    law, effect = entry.law, entry.effect  # type: ignore[attr-defined]
    if effect in effects.names():
        assert _law(law).subsystem == effects.load(effect).subsystem


@pytest.mark.parametrize("entry", [*INSIDE, *OUTSIDE], ids=lambda entry: entry.effect)
def test_entry_has_a_range_for_every_parameter_of_a_single_run(entry: object) -> None:
    own = {key for key, p in _law(entry.law).parameters.items() if p.per_run}  # type: ignore[attr-defined]
    assert own == set(entry.starts)  # type: ignore[attr-defined]
