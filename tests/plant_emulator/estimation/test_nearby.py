"""Functions whose simulations follow the steps of another one, in a fit."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pytest

from plant_emulator.errors import UnsettledError
from plant_emulator.estimation.least_squares import linearise_at
from plant_emulator.estimation.nearby import Beside, Changed, OrImpossible, near
from plant_emulator.estimation.unknowns import Unknown

A = Unknown(name="a", start=2.0, lower=0.0, upper=10.0, logarithmic=False)


@dataclass(frozen=True)
class Coarse:
    """y = 100 a at 50 samples, as it comes in steps of its own: cut to the tenth part of a unit."""

    asked: list[float] = field(default_factory=list)

    def __call__(self, v: Mapping[str, float], /) -> np.ndarray:
        return np.full((1, 50), np.floor(1000.0 * v["a"]) / 10.0)

    def near(self, there: Mapping[str, float], /) -> "Coarse":
        return Fine(asked=[*self.asked, there["a"]])


class Fine(Coarse):
    """The same along the steps of another one: exact."""

    def __call__(self, v: Mapping[str, float], /) -> np.ndarray:
        assert self.asked == [2.0]
        return np.full((1, 50), 100.0 * v["a"])


def test_slopes_are_taken_along_the_steps_at_the_point() -> None:
    """By hand 2 * 100; differences of coarse values over so small a step are 0."""
    beside = Beside(Coarse(), {"a": 7.0, "b": 0.0})
    inside = OrImpossible(Changed(beside, lambda rows: 2.0 * rows), np.zeros((1, 50)))
    found = linearise_at([A], [inside])
    assert found.jacobians[0][0, 0, 0] == pytest.approx(200.0, rel=1e-6)


class Apart(Coarse):
    """Along the steps of another one it is off by 0.5, whatever the value."""

    def __call__(self, v: Mapping[str, float], /) -> np.ndarray:
        return np.full((1, 50), 100.0 * v["a"])

    def near(self, there: Mapping[str, float], /) -> "Coarse":
        return Elsewhere()


class Elsewhere(Coarse):
    """The same, off by 0.5."""

    def __call__(self, v: Mapping[str, float], /) -> np.ndarray:
        return np.full((1, 50), 100.0 * v["a"] + 0.5)


def test_slopes_are_not_those_of_what_following_the_steps_changes() -> None:
    """0.5 over a step of 1e-8 is a slope of 5e7."""
    found = linearise_at([A], [Apart()])
    assert found.jacobians[0][0, 0, 0] == pytest.approx(100.0, rel=1e-6)
    assert found.residuals[0][0, 0] == 200.0


def test_function_without_steps_is_its_own_neighbour() -> None:
    def plain(v: Mapping[str, float]) -> np.ndarray:
        return np.full((1, 50), v["a"])

    assert near(plain, {"a": 2.0}) is plain
    assert near(Changed(plain, np.negative), {"a": 2.0})({"a": 3.0})[0, 0] == -3.0


def test_values_without_a_simulation_have_the_impossible_result_and_raise_nothing() -> None:
    """A fit may try any parameters."""

    def residual(values: Mapping[str, float]) -> np.ndarray:
        if values["drum_inertia"] < 100.0:
            raise UnsettledError("program1: 1 implicit stages did not settle")
        return np.full((4, 3), values["drum_inertia"])

    found = OrImpossible(residual, np.full((4, 3), 1e3))
    assert (found({"drum_inertia": 300.0}) == 300.0).all()
    assert (found({"drum_inertia": 50.0}) == 1e3).all()
    assert (near(found, {"drum_inertia": 300.0})({"drum_inertia": 50.0}) == 1e3).all()
