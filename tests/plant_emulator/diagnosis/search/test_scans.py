"""Scans of unknowns with many basins."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pytest

from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.search.scans import refit_scanned
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import TIME, Line, explained, noisy


class Rocking(Line):
    """y = a + sin(b t): the cost has many minima along b."""

    contact_parameters = frozenset({"b"})

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        return lambda v: (self.measured[run] - v["a"] - np.sin(v["b"] * TIME))[None, :]

    def start_values(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        """See `Model`: in the wrong basin."""
        return {"a": 0.0, "b": 27.7}, [{} for _ in runs]


class RockingBeside(Rocking):
    """The same beside effects."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        rocking, plain = super().residual(run, ()), Line.residual(self, run, effects)
        return lambda v: rocking(v) + plain(v) - plain({**v, **{f"{e}_size": 0.0 for e in effects}})


@pytest.mark.parametrize("contact", [True, False])
def test_contact_parameter_that_rests_in_a_wrong_basin_is_scanned(contact: bool) -> None:
    """By hand: d beside b = 20 the sines leave 1 - sin(d) / d, whose next minimum is at d = 7.7."""
    model = Rocking([2.0 + np.sin(20.0 * TIME)])
    model.contact_parameters = frozenset("b") if contact else frozenset()
    wrong = fit(model, (), (0,), {"a": 2.0, "b": 27.7}, [{}])
    assert wrong.values["b"] == pytest.approx(27.7, abs=0.5)
    found = refit_scanned(model, Task(base=wrong, runs=(0,)))
    assert found.values["b"] == pytest.approx(20.0 if contact else wrong.values["b"], abs=0.2)


def test_search_scans_contact_beside_an_effect_that_leaves_more_than_noise() -> None:
    """By hand: a kink of 30 has squares of 2000 30^2 / 12; the sine of 2 in a wrong basin 4000."""
    y = noisy(2.0 + 2.0 * np.sin(20.0 * TIME) + 30.0 * np.abs(TIME))
    found = explained(RockingBeside([y], ["kink"]))
    scanned = [step.effects for step in found.trace if step.action == "contact scanned"]
    assert scanned == [("kink",)]
