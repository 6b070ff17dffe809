"""The next run: it keeps within the limits, and separates two laws where they differ."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.diagnosis.missing_law.next_run import best_separation, programs
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log


@pytest.mark.parametrize("backwards", [True, False])
def test_programs_keep_within_speed_slope_and_direction(backwards: bool) -> None:
    found = list(programs(200.0, 100.0, backwards=backwards))
    assert len(found) > 10
    for program in found:
        time, reference = program.reference()
        assert np.max(np.abs(reference)) <= 200.0 * (1.0 + 1e-9)
        assert np.max(np.abs(np.diff(reference) / np.diff(time))) <= 100.0 * 1.6
        assert backwards or reference.min() >= -1e-9
        assert reference[0] == reference[-1] == 0.0


def test_laws_that_differ_in_field_weakening_are_separated_there(
    bench_log: Callable[[str], Log], nominal: ParameterSet
) -> None:
    run = recording(bench_log("bench_nominal/program1"))
    p = nominal.values()
    one = {**p, GAP_POSITION: 0.0}
    other = {**one, "flux_constant_1": 0.97 * p["flux_constant_1"]}
    found = best_separation([run], one, other)
    assert found is not None
    assert found.norm > 10.0
    # thesis, eq. 3.18: the field is weakened from here on
    weakened = p["flux_constant_1"] / p["flux_constant"] - p["flux_constant_2"]
    assert max(speed for _, speed in found.program.corners) > weakened
