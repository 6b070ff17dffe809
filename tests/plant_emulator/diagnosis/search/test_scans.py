"""Scans of unknowns with many basins."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pytest

from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.search.scans import refit_scanned
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import TIME, Line


class Rocking(Line):
    """y = a + sin(b t): the cost has many minima along b."""

    contact_parameters = frozenset({"b"})

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        return lambda v: (self.measured[run] - v["a"] - np.sin(v["b"] * TIME))[None, :]


@pytest.mark.parametrize("contact", [True, False])
def test_contact_parameter_that_rests_in_a_wrong_basin_is_scanned(contact: bool) -> None:
    """By hand: d beside b = 20 the sines leave 1 - sin(d) / d, whose next minimum is at d = 7.7."""
    model = Rocking([2.0 + np.sin(20.0 * TIME)])
    model.contact_parameters = frozenset("b") if contact else frozenset()
    wrong = fit(model, (), (0,), {"a": 2.0, "b": 27.7}, [{}])
    assert wrong.values["b"] == pytest.approx(27.7, abs=0.5)
    found = refit_scanned(model, Task(base=wrong, runs=(0,)))
    assert found.values["b"] == pytest.approx(20.0 if contact else wrong.values["b"], abs=0.2)
