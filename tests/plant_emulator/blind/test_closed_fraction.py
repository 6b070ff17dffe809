"""The true closed fraction of an answer, by hand."""

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.blind.closed_fraction import true_closed_fraction
from plant_emulator.blind.generate import simulate_truth
from plant_emulator.diagnosis.answer import SensorNoise
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import COMPARED
from tests.plant_emulator.blind.conftest import case_with, hidden
from tests.plant_emulator.blind.test_score import answer

OFFSET = hidden("torque_sensor_offset", "torque_sensor", offset=0.5)


def torque_noise(deviation: float) -> tuple[SensorNoise, ...]:
    """Noise of the shaft torque [N m]."""
    return (
        SensorNoise(
            channel="shaft_torque", deviation=deviation, correlation_time=0.01, lines=(),
            outliers=0.0, held_period=0.0, white=True,
        ),
    )  # fmt: skip


@pytest.mark.parametrize(("deviation", "floor"), [(0.5, 1e-9), (0.01, 0.5), (0.25, 1e-9)])
def test_left_gap_counts_in_the_noise_of_the_answer(
    nominal: ParameterSet, deviation: float, floor: float
) -> None:
    """A model without an offset of 0.5 N m leaves 1 or 4 times the noise's variance; 3 noises were
    open. The answer tells the noise itself, or its share of the range; the larger counts.
    """
    (log,) = simulate_truth(case_with(OFFSET), nominal)
    share = floor / float(np.ptp(log["shaft_torque"]))
    floors = dict.fromkeys(COMPARED, 1e-9) | {"shaft_torque": share}
    gap = replace(
        answer("effect").gap,
        noise_floor=floors,
        recalibrated=floors | {"shaft_torque": 3.0 * share},
    )
    found = replace(answer("effect"), gap=gap, noise=torque_noise(deviation))
    left = (0.5 / max(deviation, floor)) ** 2
    assert true_closed_fraction(found, nominal, [log]) == pytest.approx(1.0 - left / 8.0, rel=1e-3)
