"""What a logged armature voltage shows that no other channel does."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.design.detectability import detection_limits, effect_detectability
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.evidence import LJUNG_BOX_LIMIT
from plant_emulator.diagnosis.localisation.block_basis import block_quantities
from plant_emulator.diagnosis.localisation.locate import WORTHWHILE_BLOCK_GAIN, locate
from plant_emulator.diagnosis.localisation.measured_signals import measured_signals
from plant_emulator.diagnosis.localisation.parameter_sensitivities import sensitivities
from plant_emulator.diagnosis.localisation.parity_covariance import whitened_relations
from plant_emulator.diagnosis.localisation.parity_relations import (
    ARMATURE,
    DRIVE,
    GEAR,
    MOTOR,
    relation_residuals,
)
from plant_emulator.diagnosis.machines.bench import BenchModel
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.recordings.preflight import preflight
from plant_emulator.recordings.recording import OFFSET, Recording, recording
from plant_emulator.signals.log import COMPARED, VOLTAGE, Log, compared_channels, without_voltage
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import SENSORS, add_noise
from plant_emulator.simulation.simulate import simulate, values_of
from plant_emulator.solver.kernel import kernel
from plant_emulator.workflows.loading import load_recordings, with_common_voltage

Reader = Callable[[str], Log]
HEATING = "armature_resistance_heating"


def driven(
    inputs: Log,
    nominal: ParameterSet,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    seed: int = 2,
    **changed: float,
) -> Log:
    """A run of a bench with its voltage, stepped finely, with the sensors' noise."""
    values = values_of(nominal, effects) | changed
    return add_noise(simulate(inputs_of(inputs), values, gap_position=0.3, step=1e-3), seed)


def runs_of(
    bench_log: Reader,
    nominal: ParameterSet,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    programs: Sequence[int] = (1, 2),
    **changed: float,
) -> list[Recording]:
    inputs = {
        k: replace(bench_log(f"bench_nominal/program{k}"), source=f"run {k}") for k in programs
    }
    return [
        recording(driven(one, nominal, effects, seed, **changed)) for seed, one in inputs.items()
    ]


def with_voltage(log: Log, voltage: np.ndarray) -> Log:
    return Log(log.time, {**log.signals, VOLTAGE: voltage}, "run.csv")


def test_column_of_the_voltage_that_nobody_feeds_is_left_out_and_told(bench_log: Reader) -> None:
    log = bench_log("bench_practice/practice_002/program1")
    dead = with_voltage(log, np.zeros_like(log.time))
    assert compared_channels(dead) == COMPARED
    assert preflight(dead, 62.6).notes == (
        "run.csv: armature_voltage_V does not move; it is left out",
    )
    assert recording(dead).channels == COMPARED


@pytest.mark.parametrize("factor", [-1.0, 10.0, 1000.0, 1e-3])
def test_voltage_of_the_wrong_sign_or_unit_is_left_out_and_told(
    bench_log: Reader, nominal: ParameterSet, factor: float
) -> None:
    log = driven(bench_log("bench_nominal/program1"), nominal)
    checked = preflight(with_voltage(log, factor * log[VOLTAGE]), 62.6)
    (note,) = checked.notes
    assert note.startswith("run.csv: armature_voltage_V is ")
    assert note.endswith("sensor is connected); it is left out")
    left = recording(log, use=checked.use)
    assert left.channels == COMPARED
    assert VOLTAGE not in left.log
    assert preflight(log, 62.6).notes == ()


def test_voltage_without_a_sign_is_left_out_of_a_reverse_run(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    log = driven(bench_log("bench_nominal/program1"), nominal)
    turned = {name: -channel for name, channel in log.signals.items() if name != VOLTAGE}
    reverse = Log(log.time, {**turned, VOLTAGE: log[VOLTAGE]}, "run.csv")
    (note,) = preflight(reverse, 62.6).notes
    assert " V for each rad/s at reverse speed" in note
    assert preflight(with_voltage(reverse, -log[VOLTAGE]), 62.6).notes == ()


def test_voltage_of_a_sensor_that_is_not_connected_is_left_out(bench_log: Reader) -> None:
    log = bench_log("bench_practice/practice_002/program1")
    floating = with_voltage(log, 0.3 * np.random.default_rng(1).standard_normal(len(log.time)))
    assert "connected" in preflight(floating, 62.6).notes[0]
    assert VOLTAGE not in preflight(floating, 62.6).use


def test_voltage_at_the_end_of_its_range_for_most_of_a_run_is_left_out(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    log = driven(bench_log("bench_nominal/program3"), nominal)
    checked = preflight(with_voltage(log, np.minimum(log[VOLTAGE], 250.0)), 62.6)
    assert len(checked.notes) == 1
    assert "end of its range" in checked.notes[0]
    assert checked.notes[0].endswith("it is left out")
    assert set(checked.use) == set(COMPARED)


def test_runs_have_their_voltage_all_or_none(bench_log: Reader, nominal: ParameterSet) -> None:
    logs = [driven(bench_log(f"bench_nominal/program{k}"), nominal) for k in (1, 2)]
    one = replace(without_voltage(logs[0]), source="one.csv")
    recordings = [recording(log, use=preflight(log, 62.6).use) for log in (one, *logs)]
    kept, notes = with_common_voltage(recordings[:2])
    assert [r.channels for r in kept] == [COMPARED, COMPARED]
    assert [VOLTAGE in r.log for r in kept] == [False, False]
    assert [r.noise.shape for r in kept] == [r.use.shape[:1] for r in kept] == [(4,), (4,)]
    assert notes == [
        "one.csv: no armature_voltage_V that can be used; it is left out of the other logs too"
    ]
    kept, notes = with_common_voltage(recordings[1:])
    assert all(VOLTAGE in r.channels for r in kept)
    assert notes == []


def test_a_voltage_of_one_log_is_fitted_and_left_out_of_a_diagnosis(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    """A pooled fit uses it; a held-out run without it could not test what it shows."""
    with_it = replace(driven(bench_log("bench_nominal/program1"), nominal), source="one.csv")
    logs = [
        with_it,
        replace(without_voltage(bench_log("bench_nominal/program2")), source="two.csv"),
    ]
    pooled, _ = load_recordings(logs, nominal)
    assert [r.channels for r in pooled] == [(*COMPARED, VOLTAGE), COMPARED]
    common, notes = load_recordings(logs, nominal, common_channels=True)
    assert [r.channels for r in common] == [COMPARED, COMPARED]
    assert notes[-1].startswith("two.csv: no armature_voltage_V that can be used; it is left out")


def test_what_the_sensor_may_be_off_by_weighs_no_more_than_its_prior(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    """Three standard deviations of its offset cost 9, not 9 a sample; and up to 18 more by what
    they have in common with the noise.
    """
    run = recording(driven(bench_log("bench_nominal/program1"), nominal))
    off = replace(run, log=with_voltage(run.log, run.log[VOLTAGE] + 3.0 * OFFSET))
    values = nominal.values()
    before, after = (np.sum(r.strict_residual(values, 0.3)[-1] ** 2) for r in (run, off))
    assert abs(after - before) < 9.0 + 18.0
    assert before == pytest.approx(len(run.log.time), rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("gain", "offset"), [(1.0, 0.0), (1.002, 0.0), (0.995, 0.0), (1.0, 1.0)])
def test_sensor_that_is_a_little_off_is_no_gap(
    bench_log: Reader, nominal: ParameterSet, gain: float, offset: float
) -> None:
    runs = [
        recording(with_voltage(r.log, gain * r.log[VOLTAGE] + offset))
        for r in runs_of(bench_log, nominal)
    ]
    found = fit_null(BenchModel(runs, nominal, {}), range(2))
    assert found.mean_square == pytest.approx(1.0, abs=0.03)
    assert found.ljung_box_excess < LJUNG_BOX_LIMIT
    assert locate(runs, nominal, found).gain < WORTHWHILE_BLOCK_GAIN


def test_derivatives_of_the_relations_are_those_of_finite_differences(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    """What is left with a parameter taken too small, over how much: its column in `slopes`."""
    log = simulate(inputs_of(bench_log("bench_nominal/program1")), nominal.values())
    true = nominal.values()
    m = measured_signals(recording(log), true)
    q = block_quantities(m, m.drum_speed, true).means()
    for name, by_row in sensitivities(m, q, true).items():
        step = 1e-3 * true[name]
        low = relation_residuals(
            replace(m, speed=m.motor_speed), {**true, name: true[name] - step}
        )[0]
        here = relation_residuals(replace(m, speed=m.motor_speed), true)[0]
        for row, slope in by_row.items():
            difference = (low[row] - here[row]) / step
            scale = np.dot(difference, slope) / np.dot(slope, slope)
            assert scale == pytest.approx(1.0, abs=0.15), (name, row)


def test_armature_s_relation_leaves_only_white_noise(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    p = nominal.values()
    m = measured_signals(recording(driven(bench_log("bench_nominal/program1"), nominal)), p)
    found = whitened_relations(m, p)
    left = found.whiten(found.value[..., None]).reshape(-1, 4)
    assert np.sqrt(np.mean(left**2, axis=0)) == pytest.approx(1.0, abs=0.06)


def test_voltage_that_is_off_moves_the_armature_s_relation_alone(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    p = nominal.values()
    log = driven(bench_log("bench_nominal/program1"), nominal)
    cruise = (log.time[1:] > 9.0) & (log.time[1:] < 13.0)
    means = [
        whitened_relations(measured_signals(recording(one), p), p).value[:, cruise].mean(axis=1)
        for one in (log, with_voltage(log, log[VOLTAGE] + 2.0))
    ]
    moved = means[1] - means[0]
    assert moved[ARMATURE] == pytest.approx(2.0, abs=0.02)
    assert moved[[MOTOR, GEAR, DRIVE]] == pytest.approx(0.0, abs=0.02)


def test_log_without_voltage_has_three_relations(bench_log: Reader, nominal: ParameterSet) -> None:
    p = nominal.values()
    run = recording(bench_log("bench_practice/practice_004/program1"))
    assert whitened_relations(measured_signals(run, p), p).value.shape == (3, len(run.log.time) - 1)


@pytest.mark.slow
def test_resistance_is_free_where_the_voltage_shows_it(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    runs = runs_of(bench_log, nominal, armature_resistance=1.2 * 0.424)
    found = fit_null(BenchModel(runs, nominal, {}), range(2))
    error = found.standard_errors["armature_resistance"]
    assert found.values["armature_resistance"] == pytest.approx(1.2 * 0.424, abs=4.0 * error)
    assert error < 0.01
    assert found.mean_square == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("logged", [True, False])
def test_warm_armature_shows_in_the_voltage_only_and_there_as_another_resistance(
    bench_log: Reader, nominal: ParameterSet, logged: bool
) -> None:
    """In runs of 20 s a winding that takes 5 kJ/K hardly warms: it is warm from the start."""
    effects = {HEATING: kernel().effects[HEATING]}
    runs = runs_of(bench_log, nominal, programs=(1, 2, 3))
    if not logged:
        runs = [recording(without_voltage(r.log)) for r in runs]
    model = BenchModel(runs, nominal, effects)
    (found,) = detection_limits(model, fit_null(model, range(3)), range(3))
    entry = effect_detectability(found, model.candidates[HEATING])
    if logged:
        assert found.total_norm > 20.0
        assert found.orthogonal_norm < 1.0
        assert found.confounded_with == "armature_resistance"
    else:
        assert found.total_norm < 7.0
        assert "armature_voltage_V" in str(entry.needs)
    assert found.smallest_size == float("inf")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "sizes", "subsystem"),
    [
        (HEATING, {"temperature_coefficient": 0.008, "heat_capacity": 200.0}, "motor"),
        ("armature_reaction", {}, "motor"),
        ("reference_filter", {}, "drive"),
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
    runs = runs_of(bench_log, nominal, {effect: own}, (1, 2, 3))
    found = locate(runs, nominal, fit_null(BenchModel(runs, nominal, {}), range(3)))
    assert found.gain > WORTHWHILE_BLOCK_GAIN
    assert found.subsystem == subsystem


def test_noise_of_the_voltage_changes_no_other_channel_s(
    bench_log: Reader, nominal: ParameterSet
) -> None:
    log = simulate(inputs_of(bench_log("bench_nominal/program1")), nominal.values())
    others = {name: channel for name, channel in log.signals.items() if name != VOLTAGE}
    with_it, without = add_noise(log, 5), add_noise(replace(log, signals=others), 5)
    assert all(np.array_equal(with_it[name], without[name]) for name in COMPARED)
    assert np.std(with_it[VOLTAGE] - log[VOLTAGE]) == pytest.approx(SENSORS[VOLTAGE][0], rel=0.05)
