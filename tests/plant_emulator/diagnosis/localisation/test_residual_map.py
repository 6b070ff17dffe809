"""The residual map of residuals made by hand."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.diagnosis.answer import Cell
from plant_emulator.diagnosis.localisation.operating_phases import CRUISE, phases
from plant_emulator.diagnosis.localisation.residual_map import residual_map
from plant_emulator.recordings.recording import Recording, recording
from plant_emulator.signals.log import Log

BASE_SPEED = 190.0


@pytest.fixture
def run(bench_log: Callable[[str], Log]) -> Recording:
    return recording(bench_log("bench_practice/practice_004/program1"))


def cell(cells: tuple[Cell, ...], channel: str, axis: str, name: str) -> Cell:
    [found] = [c for c in cells if (c.channel, c.axis, c.bin) == (channel, axis, name)]
    return found


def test_a_gap_in_cruise_is_shown_there_and_in_the_unit_of_its_channel(run: Recording) -> None:
    phase = phases(run.log.time, run.log["speed_reference"], run.log["motor_speed"])
    residual = np.zeros_like(run.use, float)
    residual[run.channels.index("armature_current")] = np.where(phase == CRUISE, 4.0, 0.0)
    cells = residual_map([run], [residual], BASE_SPEED)
    # The current sensor of the logs has a noise of 0.25 A.
    assert cell(cells, "armature_current", "phase", "cruise").gap == pytest.approx(1.0, rel=0.05)
    assert cell(cells, "armature_current", "phase", "acceleration").gap == 0.0
    assert cell(cells, "shaft_torque", "phase", "cruise").gap == 0.0


def test_runs_are_pooled_by_their_samples(run: Recording) -> None:
    one, three = np.full(run.use.shape, 1.0), np.full(run.use.shape, 3.0)
    cells = residual_map([run, run], [one, three], BASE_SPEED)
    found = cell(cells, "shaft_torque", "direction", "forward")
    assert found.gap / found.noise == pytest.approx(np.sqrt(5.0))  # the mean of 1 and 9


def test_samples_that_do_not_count_are_left_out(run: Recording) -> None:
    half = np.arange(run.use.shape[1]) < 900
    used = Recording(run.log, run.inputs, run.channels, run.noise, run.use & half)
    cells = residual_map([used], [np.where(half, 1.0, 100.0) * used.use], BASE_SPEED)
    found = cell(cells, "drum_speed", "phase", "cruise")
    assert found.gap / found.noise == pytest.approx(1.0)


def test_a_sine_lies_in_its_band_of_frequency(run: Recording) -> None:
    wave = np.sqrt(2.0) * np.sin(2.0 * np.pi * 5.0 * run.log.time)
    cells = residual_map([run], [np.tile(wave, (len(run.channels), 1))], BASE_SPEED)
    inside = cell(cells, "motor_speed", "frequency", "3 to 10 Hz")
    outside = cell(cells, "motor_speed", "frequency", "0.3 to 1 Hz")
    noise = run.noise[run.channels.index("motor_speed")]
    assert inside.gap == pytest.approx(noise, rel=0.01)  # rms 1 in the noise, all in this band
    assert outside.gap < 0.05 * noise


def test_white_noise_has_no_excess_in_any_bin(run: Recording) -> None:
    residual = np.random.default_rng(1).standard_normal(run.use.shape)
    cells = residual_map([run], [residual], BASE_SPEED)
    assert {c.axis for c in cells} == {"phase", "speed", "load", "direction", "time", "frequency"}
    for c in cells:
        assert abs((c.gap / c.noise) ** 2 - 1.0) < 4.0 * np.sqrt(2.0 / c.samples)
