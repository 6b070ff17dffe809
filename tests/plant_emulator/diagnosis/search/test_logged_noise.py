"""The noise around a fit, on a machine so small that it can be checked by hand."""

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.search.logged_noise import estimate_noise
from tests.plant_emulator.diagnosis.line import SHAPES, TIME, Line, noisy
from tests.plant_emulator.diagnosis.screening.warm import Warm


def test_hum_that_sampling_folds_to_a_slow_wave_leaves_white_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of 50.08 Hz at 100 Hz the double is a wave of 6 s: an effect that acts for 2 s follows it."""
    time = 0.01 * np.arange(len(TIME))
    turns = 2.0 * np.pi * 50.08 * time
    hum = 3.0 * np.cos(turns + 0.4) + 2.0 * np.cos(2.0 * turns)
    monkeypatch.setitem(SHAPES, "bump", lambda x: np.exp(-((x / 0.1) ** 2)))
    quiet = 1.0 + 2.0 * TIME
    model = Line([noisy(quiet), noisy(quiet + hum, 1)], ["bump"])
    model.runs = [replace(run, time=time) for run in model.runs]
    found = estimate_noise(model, Task(base=fit_null(model, (0, 1)), runs=(0, 1)))
    assert [one.lines == () for (one,) in found.whiteners.values()] == [True, False]
    noise = found.channels["y"]
    assert noise.colour.order == 0
    assert noise.deviation == pytest.approx(1.0, abs=0.05)
    # The mirror image at 49.92 Hz has the same samples.
    assert abs(noise.lines[0] - 50.0) == pytest.approx(0.08, abs=0.005)
    # By hand: half the squares of the amplitudes, in one of two runs.
    assert noise.disturbance == pytest.approx(0.25 * (3.0**2 + 2.0**2), rel=0.05)


def test_effect_that_acts_by_a_state_of_each_run_leaves_white_noise() -> None:
    """At the start of its state it hardly shows: its waves must not pass for colour."""
    model = Warm()
    found = estimate_noise(model, Task(base=fit_null(model, (0, 1)), runs=(0, 1)))
    noise = found.channels["y"]
    assert noise.colour.order == 0
    assert noise.deviation == pytest.approx(1.0, abs=0.05)
