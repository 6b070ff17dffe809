"""The floor of the gap: what repeats leave of each other, and the sensors' noise, on known axes."""

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.axis.effects import LIBRARY
from plant_emulator.diagnosis.axis.floor import repeat_floor, sensor_floor
from plant_emulator.diagnosis.axis.held_out import HeldOut
from plant_emulator.diagnosis.axis.start import best_width, prepared, start
from plant_emulator.signals.axis_log import AxisLog
from plant_emulator.signals.noise import noise
from tests.plant_emulator.diagnosis import axis_truth as truth

WANDER = 3.0
"""Force that differs from repeat to repeat [N], a sine of another phase in each."""


def held_out(*logs: AxisLog) -> HeldOut:
    """The runs, the last one predicted."""
    runs, scale = prepared(logs)
    width = best_width(runs[:-1], scale, ())
    scale = replace(scale, width=width)
    regression, rows, _ = start(runs, scale, len(runs) - 1, LIBRARY, width)
    fitted = tuple(range(len(runs) - 1))
    return HeldOut(rows=rows, regression=regression, folds=((fitted, (len(runs) - 1,)),))


def wandering(seed: int) -> AxisLog:
    """A repeat of one motion, with what differs from run to run and what all of them miss."""
    time = truth.motion()[0]
    apart = WANDER * np.sin(2.0 * np.pi * 0.7 * time + 1.5 * seed)
    return truth.log(lambda q, v, a: apart + 8.0 * np.sin(2.0 * np.pi * q / 0.02), seed=seed)


@pytest.mark.slow
def test_repeats_leave_half_the_square_of_their_difference() -> None:
    """Phases of 1.5 rad apart: rms of the difference is WANDER 2 sin(0.75) / sqrt(2)."""
    found = repeat_floor(held_out(wandering(1), wandering(2)))
    assert found is not None
    apart = WANDER * np.sqrt(2.0) * np.sin(0.75) / np.sqrt(2.0)
    # Friction and inertia of the fit follow a part; the kernel keeps some of the noise of 2 N.
    assert found == pytest.approx(apart, rel=0.2)


@pytest.mark.slow
def test_other_motions_are_no_repeats() -> None:
    assert repeat_floor(held_out(truth.log(), truth.log(phase=1.0, seed=2))) is None


@pytest.mark.slow
def test_a_force_that_changes_quickly_is_no_noise_where_the_axis_follows_it() -> None:
    whole = truth.log()
    pushed = replace(whole, position=whole.position.copy(), force=whole.force.copy())
    for tone in 2.0 * np.pi * np.array([70.0, 90.0]):
        way = -30.0 / (truth.MASS * tone**2)
        pushed.position[:] += way * np.cos(tone * whole.time)
        pushed.force[:] += 30.0 * np.cos(tone * whole.time)
        pushed.force[:] -= truth.VISCOUS * way * tone * np.sin(tone * whole.time)
    calm, fast = (thinned(log) for log in (whole, pushed))
    # The estimate from the force alone takes the tones for noise.
    assert noise(fast.force) > 10.0 * noise(calm.force)
    found = [sensor_floor(held_out(log, log).rows, truth.MASS) for log in (calm, fast)]
    assert found[1] < 2.0 * found[0]


def thinned(log: AxisLog) -> AxisLog:
    """Every fourth sample of a log: 250 Hz."""
    return replace(log, time=log.time[::4], position=log.position[::4], force=log.force[::4])
