"""What a logged armature voltage shows that no other channel does."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.bench import BenchModel
from plant_emulator.diagnosis.contest import null_fit
from plant_emulator.diagnosis.detect import as_answer, detectability
from plant_emulator.diagnosis.locate import WORTH, locate
from plant_emulator.diagnosis.relations import ARMATURE, DRIVE, GEAR, MOTOR, measured
from plant_emulator.diagnosis.whiten import relations
from plant_emulator.errors import LogError
from plant_emulator.kernel import kernel
from plant_emulator.log import COMPARED, VOLTAGE, Log, compared
from plant_emulator.parameters import ParameterSet
from plant_emulator.preflight import preflight
from plant_emulator.recording import Recording, recording
from plant_emulator.sensors import SENSORS, noisy
from plant_emulator.simulate import run_of, simulate, values_of

Reader = Callable[[str], Log]
HEATING = "armature_resistance_heating"


def driven(
    inputs: Log,
    nominal: ParameterSet,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    **changed: float,
) -> Log:
    """A run of a bench with its voltage, stepped finely, with the sensors' noise."""
    values = values_of(nominal, effects) | changed
    return noisy(simulate(run_of(inputs), values, gap_position=0.3, step=1e-3), seed=2)


def two_runs(
    bench_log: Reader,
    nominal: ParameterSet,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    **changed: float,
) -> list[Recording]:
    inputs = [replace(bench_log(f"bench_nominal/program{k}"), source=f"run {k}") for k in (1, 2)]
    return [recording(driven(one, nominal, effects, **changed)) for one in inputs]


def with_voltage(log: Log, voltage: np.ndarray) -> Log:
    return Log(log.time, {**log.signals, VOLTAGE: voltage}, "run.csv")


def test_column_of_the_voltage_that_nobody_feeds_is_left_out_and_told(bench_log: Reader) -> None:
    log = bench_log("bench_practice/practice_002/program1")
    dead = with_voltage(log, np.zeros_like(log.time))
    assert compared(dead) == COMPARED
    assert preflight(dead, 62.6).notes == (
        "run.csv: armature_voltage_V does not move; it is left out",
    )
    assert recording(dead).channels == COMPARED


def test_voltage_of_the_wrong_sign_is_told(bench_log: Reader, nominal: ParameterSet) -> None:
    log = driven(bench_log("bench_nominal/program1"), nominal)
    with pytest.raises(LogError, match=r"^run.csv: armature_voltage_V is -\d+\.\d while the motor"):
        preflight(with_voltage(log, -log[VOLTAGE]), 62.6)
    assert preflight(log, 62.6).notes == ()


def test_armature_s_relation_leaves_only_white_noise(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    p = nominal.values()
    m = measured(recording(driven(bench_log("bench_nominal/program1"), nominal)), p)
    found = relations(m, p)
    left = found.white(found.value[..., None]).reshape(-1, 4)
    assert np.sqrt(np.mean(left**2, axis=0)) == pytest.approx(1.0, abs=0.06)


def test_voltage_that_is_off_moves_the_armature_s_relation_alone(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    p = nominal.values()
    log = driven(bench_log("bench_nominal/program1"), nominal)
    cruise = (log.time[1:] > 9.0) & (log.time[1:] < 13.0)
    means = [
        relations(measured(recording(one), p), p).value[:, cruise].mean(axis=1)
        for one in (log, with_voltage(log, log[VOLTAGE] + 2.0))
    ]
    moved = means[1] - means[0]
    assert moved[ARMATURE] == pytest.approx(2.0, abs=0.02)
    assert moved[[MOTOR, GEAR, DRIVE]] == pytest.approx(0.0, abs=0.02)


def test_log_without_voltage_has_three_relations(bench_log: Reader, nominal: ParameterSet) -> None:
    p = nominal.values()
    run = recording(bench_log("bench_practice/practice_004/program1"))
    assert relations(measured(run, p), p).value.shape == (3, len(run.log.time) - 1)


@pytest.mark.slow
def test_resistance_is_free_where_the_voltage_shows_it(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    runs = two_runs(bench_log, nominal, armature_resistance=1.2 * 0.424)
    found = null_fit(BenchModel(runs, nominal, {}), range(2))
    error = found.errors["armature_resistance"]
    assert found.values["armature_resistance"] == pytest.approx(1.2 * 0.424, abs=4.0 * error)
    assert error < 0.01
    assert found.chi_squared == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("logged", [True, False])
def test_warm_armature_shows_in_the_voltage_and_only_there(
    bench_log: Reader, nominal: ParameterSet, logged: bool
) -> None:
    effects = {HEATING: kernel().effects[HEATING]}
    runs = two_runs(bench_log, nominal)
    if not logged:
        runs = [
            recording(
                replace(r.log, signals={k: v for k, v in r.log.signals.items() if k != VOLTAGE})
            )
            for r in runs
        ]
    model = BenchModel(runs, nominal, effects)
    (found,) = detectability(model, null_fit(model, range(2)), range(2))
    entry = as_answer(found, model.candidates[HEATING])
    if logged:
        assert found.norm > 7.0
        assert entry["needs"] is None
    else:
        assert found.norm < 7.0
        assert "armature_voltage_V" in str(entry["needs"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "sizes", "subsystem"),
    [
        (HEATING, {"temperature_coefficient": 0.008, "heat_capacity": 200.0}, "motor"),
        ("armature_reaction", {}, "motor"),
    ],
)
def test_place_of_what_the_voltage_shows(
    bench_log: Reader,
    nominal: ParameterSet,
    effect: str,
    sizes: dict[str, float],
    subsystem: str,
) -> None:
    own = {**kernel().effects[effect].plausible(), **sizes}
    runs = two_runs(bench_log, nominal, {effect: own})
    model = BenchModel(runs, nominal, {})
    found = locate(runs, nominal, null_fit(model, range(2)))
    assert found.gain > WORTH
    assert found.subsystem == subsystem


def test_noise_of_the_voltage_changes_no_other_channel_s(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    log = simulate(run_of(bench_log("bench_nominal/program1")), nominal.values())
    others = {name: channel for name, channel in log.signals.items() if name != VOLTAGE}
    with_it, without = noisy(log, 5), noisy(replace(log, signals=others), 5)
    assert all(np.array_equal(with_it[name], without[name]) for name in COMPARED)
    assert np.std(with_it[VOLTAGE] - log[VOLTAGE]) == pytest.approx(SENSORS[VOLTAGE][0], rel=0.05)
