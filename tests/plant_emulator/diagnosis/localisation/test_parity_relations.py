"""The relations between measured signals, on logs of the independent bench."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.localisation.measured_signals import measured_signals, smoothed_speed
from plant_emulator.diagnosis.localisation.parity_covariance import whitened_relations
from plant_emulator.diagnosis.localisation.parity_relations import (
    DRIVE,
    GEAR,
    MOTOR,
    delayed_reference,
    reconstructed_reference,
    relation_residuals,
    speed_error,
)
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.recordings.recording import Recording, recording
from plant_emulator.signals.log import Log


@pytest.fixture
def run(bench_log: Callable[[str], Log]) -> Recording:
    """A run of the independent bench with noise, without effect and without drift."""
    return recording(bench_log("bench_practice/practice_004/program1"))


def whitened(run: Recording, nominal: ParameterSet) -> np.ndarray:
    found = whitened_relations(measured_signals(run, nominal.values()), nominal.values())
    return found.whiten(found.value[..., None]).reshape(-1, 3)


def smooth_rms(whitened: np.ndarray, length: int = 20) -> np.ndarray:
    """Scaled rms of means over 20 samples: 1 for white noise, more for correlated noise."""
    whole = whitened[: len(whitened) // length * length].reshape(-1, length, 3)
    return np.sqrt(np.mean(whole.sum(axis=1) ** 2, axis=0) / length)


def test_on_the_nominal_bench_only_white_noise_of_variance_1_is_left(
    run: Recording, nominal: ParameterSet
) -> None:
    left = whitened(run, nominal)
    assert np.sqrt(np.mean(left**2, axis=0)) == pytest.approx(1.0, abs=0.06)
    assert smooth_rms(left) == pytest.approx(1.0, abs=0.25)


# Flux at 380 rad/s, 366.83 / (8.0644 + 380) (thesis, eq. 3.17 and Table 3.1).
FLUX_IN_CRUISE = 0.945


@pytest.mark.parametrize(
    ("channel", "change", "moved"),
    [
        ("shaft_torque", 0.5, {MOTOR: -0.5, GEAR: 0.5, DRIVE: 0.0}),
        ("armature_current", 0.5, {MOTOR: -0.5 * FLUX_IN_CRUISE, GEAR: 0.0, DRIVE: 0.0}),
        ("speed_reference", 1.0, {MOTOR: 0.0, GEAR: 0.0, DRIVE: -1.0}),
    ],
)
def test_a_signal_that_is_off_moves_the_relations_that_it_is_in_and_no_other(
    run: Recording, nominal: ParameterSet, channel: str, change: float, moved: dict[int, float]
) -> None:
    signals = {**run.log.signals, channel: run.log[channel] + change}
    off = replace(run, log=replace(run.log, signals=signals))
    p = nominal.values()
    cruise = (run.log.time[1:] > 9.0) & (run.log.time[1:] < 13.0)
    before, after = (
        whitened_relations(measured_signals(r, p), p).value[:, cruise].mean(axis=1)
        for r in (run, off)
    )
    for row, expected in moved.items():
        assert after[row] - before[row] == pytest.approx(expected, abs=0.02)


def test_without_a_current_only_the_gear_s_relation_tells_anything(
    run: Recording, nominal: ParameterSet
) -> None:
    signals = {k: v for k, v in run.log.signals.items() if k != "armature_current"}
    left = whitened(recording(replace(run.log, signals=signals)), nominal)
    rms = np.sqrt(np.mean(left**2, axis=0))
    assert rms[GEAR] == pytest.approx(1.0, abs=0.06)
    assert rms[[MOTOR, DRIVE]] == pytest.approx(0.0, abs=0.1)


def test_the_smoothed_speed_has_less_than_half_of_the_noise(
    bench_log: Callable[[str], Log], nominal: ParameterSet
) -> None:
    true = bench_log("bench_nominal/program1")
    noise = np.array([0.15, 0.01, 0.25, 0.25])
    random = np.random.default_rng(1)
    channels = ("motor_speed", "armature_current", "shaft_torque")
    seen = [
        true[c] + noise[k] * random.standard_normal(len(true.time))
        for c, k in zip(channels, (0, 2, 3), strict=True)
    ]
    found = smoothed_speed(true.time, *seen, noise, nominal.values())
    assert np.std(found - true["motor_speed"]) < 0.15 / 2.0


def test_a_limit_of_the_simulated_drive_counts_only_next_to_one_of_the_real_drive(
    run: Recording, nominal: ParameterSet
) -> None:
    p = nominal.values()
    # At its limit of 72 A (thesis, eq. 3.5) for a while.
    current = np.where(np.arange(len(run.log.time)) // 10 == 100, 72.0, 20.0)
    signals = replace(measured_signals(run, p), current=current)
    limited = relation_residuals(signals, p)[1]
    last = int(np.flatnonzero(limited)[-1])
    also = np.zeros_like(limited)
    soon, late = last + 3, last + 60
    also[[soon, late]] = True
    found = whitened_relations(signals, p, (np.zeros((3, len(limited))), also))
    drive = np.abs(found.whiten(np.ones((3, len(limited), 1))).reshape(-1, 3)[:, DRIVE])
    assert drive[soon] < 0.01 * drive[late]


def test_speed_error_of_a_small_voltage_is_that_of_both_controllers_solved_backwards(
    run: Recording, nominal: ParameterSet
) -> None:
    p = nominal.values()
    m = measured_signals(run, p)
    voltage = p["armature_resistance"] * m.current + FLUX_IN_CRUISE * m.motor_speed
    more = np.random.default_rng(1).normal(size=len(m.time))
    (plain, limited), (found, also) = (
        reconstructed_reference(replace(m, voltage=own), p, delayed_reference(m, 0.0))
        for own in (voltage, voltage + 1e-3 * more)
    )
    before = slice(0, int(np.argmax(np.append(limited | also, True))))
    assert before.stop > 100
    shown = speed_error(more[:, None], m.time, p)[:, 0]
    expected = (found - plain) / 1e-3
    np.testing.assert_allclose(shown[before], expected[before], rtol=1e-3, atol=1e-4)
