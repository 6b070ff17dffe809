"""Val1, Val2 and NRMSD by hand."""

from math import sqrt

import numpy as np
import pytest

from plant_emulator.errors import LogError
from plant_emulator.log import Log
from plant_emulator.validate import fit, validate

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
