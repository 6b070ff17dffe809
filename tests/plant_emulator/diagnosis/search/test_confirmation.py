"""Fits of a hypothesis from its starts, and the order in which hypotheses are fitted."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.execution.pool import TaskRunner
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.joint_fit import fit, fit_null
from plant_emulator.diagnosis.fitting.task import Task
from plant_emulator.diagnosis.search import search
from plant_emulator.diagnosis.search.confirmation import Trial, confirm, without_effects
from plant_emulator.diagnosis.search.promise import Promise, Start
from plant_emulator.diagnosis.search.screening import promises
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import TIME, Line, explained, noisy

WAVE = noisy(2.0 + 3.0 * TIME + 4.0 * np.sin(20.0 * TIME))


class Counting(Line):
    """A line that counts how often it is asked for its nominal parameters."""

    asked = 0

    def nominal(self, runs: Sequence[int]) -> dict[str, float]:
        """See `Model`."""
        self.asked += 1
        return super().nominal(runs)


@pytest.mark.parametrize(("size", "asked"), [(4.1, 0), (-20.0, 1)])
def test_plausible_size_is_a_start_only_where_all_starts_are_far(size: float, asked: int) -> None:
    model = Counting([WAVE])
    start = Start(values={"a": 2.0, "b": 3.0, "wave_size": size}, states=({},))
    found = confirm(model, Trial(("wave",), (0,), (start,)))
    assert model.asked == asked
    assert found.values["wave_size"] == pytest.approx(4.0, abs=0.1)


class Simulating(Line):
    """A line that simulates every effect whose size is among the values, as the bench does."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            names = [name for name in self.candidates if f"{name}_size" in v]
            return super(Simulating, self).residual(run, names)(v)

        return residual


@pytest.mark.parametrize("size", [0.1, 4.0])
def test_fit_without_effects_starts_anew_only_where_that_leaves_less(size: float) -> None:
    """A wave of 4 is the cause, and its values leave 9 without it. One of 0.1 led there by luck."""
    model = Simulating([noisy(2.0 + 3.0 * TIME + size * np.sin(20.0 * TIME))])
    null = fit_null(model, (0,))
    other = fit(model, ("wave",), (0,), {**null.values, "wave_size": size}, [{}])
    known = replace(null, values={"a": 3.0, "b": 3.0}, sum_of_squares=2.0 * null.samples)
    found = without_effects(model, (known, Task(base=other, runs=(0,))))
    assert (found is known) == (size == 4.0)
    assert found.effects == ()
    assert size == 4.0 or found.cost == pytest.approx(null.cost)


def test_leaders_of_each_regression_are_fitted_until_one_leaves_little(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The relations, as the first score, stand for a cube where a wave acts."""

    def with_relations(runner: TaskRunner, base: FitResult) -> list[Promise]:
        found = promises(runner, base)
        wrong = {"cube": 900.0, "wave": 90.0}
        return [replace(p, gains={"relations": wrong.get(p.effect, 0.0), **p.gains}) for p in found]

    monkeypatch.setattr(search, "promises", with_relations)
    found = explained(Line([WAVE]))
    confirmed = [step.effects for step in found.trace if step.action == "confirmed"]
    assert confirmed[:2] == [("cube",), ("wave",)]
    assert "fit by secants" not in {name for step in found.trace for name in step.promised or {}}
    assert found.final.effects == ("wave",)
