"""What the quantiser of a coarse channel may be off by is noise."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.recordings.recording import Recording, recording
from plant_emulator.signals.log import Log
from plant_emulator.simulation.sensor_noise import add_noise


def measured(log: Log, step: float) -> Recording:
    """The run with noise; its drum speed is in steps [rad/s]."""
    noisy = add_noise(log, 1)
    rounded = np.round(noisy["drum_speed"] / step) * step
    return recording(Log(noisy.time, {**noisy.signals, "drum_speed": rounded}, "run.csv"))


def squares_of_gain(run: Recording, error: float) -> float:
    """Squares by which a gain of the drum speed that is off raises those of the plain run."""
    row = run.channels.index("drum_speed")
    plain = {name: run.log[name] for name in run.channels}
    off = {**plain, "drum_speed": (1.0 + error) * plain["drum_speed"]}
    (white, zero) = (run.residual_of(Log(run.log.time, one, "")) for one in (off, plain))
    return float(np.sum((white - zero)[row] ** 2))


def test_a_gain_that_is_off_by_a_part_of_a_step_tells_nothing_of_a_coarse_channel(
    bench_log: Callable[[str], Log],
) -> None:
    """By hand: r = X c with |c| <= 1 leaves r' (1 + X X')^-1 r < 1; 2e-4 of 6 rad/s is 0.05 steps.

    A fine channel shows sum (2e-4 w)^2 over its variance.
    """
    log = bench_log("bench_nominal/program3")
    coarse, fine = measured(log, 0.0218), measured(log, 0.001)
    assert squares_of_gain(coarse, 2e-4) < 1.0
    row = fine.channels.index("drum_speed")
    expected = np.sum((2e-4 * log["drum_speed"]) ** 2) / fine.noise[row] ** 2
    assert squares_of_gain(fine, 2e-4) == pytest.approx(expected, rel=0.05)
    # A radius that is off by a percent is far more than what a quantiser may be off by.
    assert squares_of_gain(coarse, 0.01) > 500.0


def test_spikes_and_samples_that_do_not_count_do_not_hide_the_steps(
    bench_log: Callable[[str], Log],
) -> None:
    log = bench_log("bench_nominal/program3")
    plain = measured(log, 0.0218)
    value, use = plain.log["drum_speed"].copy(), np.ones(len(log.time), bool)
    value[1000:1100] = np.linspace(value[1000], value[1100], 100)
    use[1000:1100] = False
    value[[500, 2000, 3000]] += 60.0
    holed = Log(log.time, {**plain.log.signals, "drum_speed": value}, "run.csv")
    found = recording(holed, use={"drum_speed": use})
    offset, gain = found.quantiser_errors["drum_speed"]
    assert offset == pytest.approx(0.00218)
    assert gain == pytest.approx(0.00218 / np.quantile(np.abs(log["drum_speed"]), 0.99), rel=0.02)
