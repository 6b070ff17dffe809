"""Each effect fitted by secants, on a machine so small that it can be checked by hand."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.fitting.joint_fit import fit, fit_null
from plant_emulator.diagnosis.search.promise import Promise, Start, leading, starts_of
from plant_emulator.diagnosis.search.secant_fits import SecantFits, fit_by_secants
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import TIME, Line, noisy


def promised(model: Line) -> dict[str, Promise]:
    base = fit_null(model, (0,))
    asked = SecantFits(base, (0,), tuple(model.candidates), {}, 5)
    return {p.effect: p for p in fit_by_secants(model, asked)}


def test_gain_is_that_of_the_whole_fit_where_all_is_linear() -> None:
    """By hand: a wave of size A takes n A^2 / 2 from the squares, and half of it is the gain."""
    found = promised(Line([noisy(2.0 + 3.0 * TIME - 3.0 * np.sin(20.0 * TIME))]))
    assert found["wave"].gain == pytest.approx(3.0**2 * 2000 / 4, rel=0.06)
    assert found["cube"].gain < 10.0
    (start,) = found["wave"].starts
    assert start.values["wave_size"] == pytest.approx(-3.0, abs=0.1)


class Decaying(Line):
    """y = a exp(b x), and effects."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        plain = super().residual(run, effects)

        def residual(v: Mapping[str, float]) -> Array:
            law = v["a"] * np.exp(v["b"] * TIME)
            return plain({**v, "a": 0.0, "b": 0.0}) - law[None, :]

        return residual


def test_parameters_that_bent_without_the_cause_unbend() -> None:
    """The cube passes for decay: without it b is below -0.7 for -0.5."""
    model = Decaying([noisy(10.0 * np.exp(-0.5 * TIME) - 5.0 * TIME**3)], ["wave", "cube"])
    base = fit_null(model, (0,))
    assert base.values["b"] < -0.7
    whole = fit(model, ("cube",), (0,), {"a": 10.0, "b": -0.5, "cube_size": -5.0}, [{}])
    found = promised(model)
    assert found["cube"].gain == pytest.approx(0.5 * (base.cost - whole.cost), rel=0.02)
    (start,) = found["cube"].starts
    assert start.values["b"] == pytest.approx(-0.5, abs=0.05)


def promise(effect: str, **gains: float) -> Promise:
    return Promise(effect=effect, gains=gains, starts=())


def test_leaders_of_each_score_gain_half_of_its_most() -> None:
    """a is fitted already; b leads the relations, and c gains half of the simulation's most."""
    found = [
        promise("a", relations=1.0, simulation=90.0),
        promise("b", relations=20.0, simulation=6.0),
        promise("c", relations=8.0, simulation=50.0),
        promise("d", relations=15.0, simulation=47.0),
        promise("e", relations=13.0, simulation=44.0),
    ]
    assert [p.effect for p in leading(found, 2, 5.0, ["a"])] == ["b", "d", "c"]
    assert [p.effect for p in leading(found, 2, 25.0, ["a"])] == ["c", "d"]
    assert [p.effect for p in leading(found, 1, 5.0)] == ["b", "a"]


def test_effect_also_starts_at_the_parameters_of_the_set() -> None:
    base = replace(
        fit_null(Line([noisy(2.0 + 3.0 * TIME)]), (0,)),
        values={"a": 2.0, "b": 3.0},
        states=({"angle": 0.5},),
    )
    estimated = Start(
        values={"a": 7.0, "b": 8.0, "wave_size": 0.3}, states=({"angle": 0.9, "phase": 0.1},)
    )
    first, kept = starts_of(Promise(effect="wave", gains={}, starts=(estimated,)), base)
    assert first == estimated
    assert kept.values == {"a": 2.0, "b": 3.0, "wave_size": 0.3}
    assert kept.states == ({"angle": 0.5, "phase": 0.1},)
