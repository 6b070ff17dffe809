"""Val1, Val2 and NRMSD by hand."""

from math import sqrt

import numpy as np
import pytest

from plant_emulator.errors import LogError
from plant_emulator.signals.log import Log
from plant_emulator.simulation.fit_metrics import fit, validate, zero_phase

MEASURED = np.array([0.0, 2.0, 4.0, 2.0])
SIMULATED = np.array([0.0, 1.0, 4.0, 4.0])


def test_measures_by_hand() -> None:
    """Errors 0, 1, 0, -2: rms sqrt(5/4), range 4, sum |e| 3, sum |y| 8."""
    found = fit(MEASURED, SIMULATED)
    assert found.rms == pytest.approx(sqrt(1.25))
    assert found.nrmsd == pytest.approx(sqrt(1.25) / 4)
    assert found.val1 == pytest.approx(100 * (1 - sqrt(1.25) / 4))
    assert found.val2 == pytest.approx(100 * (1 - 3 / 8))


def test_perfect_simulation_is_100_percent() -> None:
    found = fit(MEASURED, MEASURED)
    assert (found.val1, found.val2, found.nrmsd) == (100.0, 100.0, 0.0)


def test_offset_of_the_measured_channel_does_not_change_its_nrmsd() -> None:
    assert fit(MEASURED + 100, SIMULATED + 100).nrmsd == pytest.approx(
        fit(MEASURED, SIMULATED).nrmsd
    )


@pytest.mark.parametrize("level", [0.0, 3.0])
def test_channel_that_does_not_move_is_refused(level: float) -> None:
    with pytest.raises(LogError, match=r"run\.csv: drum_speed: it does not move"):
        fit(np.full(4, level), SIMULATED, "run.csv: drum_speed")


def test_only_the_channels_that_were_measured_are_judged() -> None:
    time = np.arange(4.0)
    measured = Log(time, {"motor_speed": MEASURED, "shell_temperature": MEASURED})
    simulated = Log(time, {"motor_speed": SIMULATED, "drum_speed": SIMULATED})
    assert list(validate(measured, simulated)) == ["motor_speed"]


def wave(frequency: float, samples: int = 1000) -> Log:
    """A sine of 100 Hz sampling on the motor speed."""
    time = np.arange(samples) * 0.01
    return Log(time, {"motor_speed": np.sin(2 * np.pi * frequency * time)}, "wave")


def test_filter_halves_the_amplitude_at_its_cutoff_and_shifts_no_phase() -> None:
    """Butterworth, twice: |H|^2 = 1 / (1 + (f / f_c)^4), with f_c warped by the sampling."""
    log = wave(5.0)
    filtered = zero_phase(log, 5.0)
    middle = slice(100, -100)
    expected = 0.5 * log["motor_speed"][20:-20]
    assert filtered["motor_speed"][middle] == pytest.approx(expected[middle], abs=5e-3)
    assert len(filtered.time) == 1000 - 2 * 20  # a period of 0.2 s dropped at either end
    slow = zero_phase(wave(1.0), 5.0)["motor_speed"]
    assert np.max(slow[middle]) == pytest.approx(1 / (1 + (1 / 5) ** 4), rel=3e-3)


def test_filter_leaves_the_inputs_alone() -> None:
    log = Log(wave(5.0).time, {**wave(5.0).signals, "speed_reference": wave(20.0)["motor_speed"]})
    assert (zero_phase(log, 5.0)["speed_reference"] == log["speed_reference"][20:-20]).all()


@pytest.mark.parametrize("cutoff", [60.0, 0.1])
def test_filter_that_the_log_cannot_take_is_refused(cutoff: float) -> None:
    with pytest.raises(LogError, match="wave: cannot be filtered at"):
        zero_phase(wave(1.0), cutoff)


def test_unevenly_sampled_log_is_not_filtered() -> None:
    log = wave(1.0)
    keep = np.arange(1000) != 500
    with pytest.raises(LogError, match="not evenly sampled"):
        zero_phase(Log(log.time[keep], {"motor_speed": log["motor_speed"][keep]}, "wave"), 5.0)
