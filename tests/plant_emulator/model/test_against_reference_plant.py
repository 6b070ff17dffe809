"""The composed, eliminated, compiled model against the plain equations of tests/reference_plant."""

import numpy as np
import pytest

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import Log
from plant_emulator.simulation.fit_metrics import validate
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import simulate
from tests import reference_plant

RUNS = {
    "ramp up, stop, stick": (((0.1, 0.0), (1.1, 120.0), (1.6, 120.0), (2.3, 0.0)), 0.0),
    "through zero": (((0.1, 0.0), (0.6, 60.0), (1.2, -60.0), (1.5, -60.0)), 0.7),
    "current and voltage at their limits": (
        ((0.1, 0.0), (0.3, 250.0), (2.5, 250.0), (2.7, 100.0)),
        -0.5,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_model_is_the_thesis_equations(nominal: ParameterSet, name: str) -> None:
    corners, gap_position = RUNS[name]
    time = np.round(np.arange(301) * 0.01, 9)
    plain = reference_plant.simulate(corners, time, gap_position)
    reference = np.interp(time, *zip(*corners, strict=True))
    expected = Log(time, {"speed_reference": reference, **plain}, "reference plant")
    found = simulate(inputs_of(expected), nominal.values(), gap_position=gap_position)
    for channel, fit in validate(expected, found).items():
        assert fit.nrmsd <= 5e-5, (channel, fit.nrmsd)


def test_limits_are_reached_in_the_run_that_is_to_reach_them(nominal: ParameterSet) -> None:
    corners, gap_position = RUNS["current and voltage at their limits"]
    time = np.round(np.arange(301) * 0.01, 9)
    reference = np.interp(time, *zip(*corners, strict=True))
    run = inputs_of(Log(time, {"speed_reference": reference}))
    log = simulate(run, nominal.values(), gap_position=gap_position)
    assert np.sum(np.abs(log["armature_current"]) > 70.0) > 5
