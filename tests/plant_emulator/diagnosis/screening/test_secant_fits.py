"""Each effect fitted by secants, on a machine so small that it can be checked by hand."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pytest

from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.screening.promise import Promise
from plant_emulator.diagnosis.screening.secant_fits import SecantFits, fit_by_secants
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import TIME, Line, noisy
from tests.plant_emulator.diagnosis.screening.late import Late, late_pulses


def promised(model: Line) -> dict[str, Promise]:
    base = fit_null(model, (0,))
    asked = SecantFits(base, (0,), tuple(model.candidates), {}, 5)
    return {p.effect: p for p in fit_by_secants(model, asked)}


def test_gain_is_that_of_the_whole_fit_where_all_is_linear() -> None:
    """By hand: a wave of size A takes n A^2 / 2 from the squares, and half of it is the gain."""
    found = promised(Line([noisy(2.0 + 3.0 * TIME - 3.0 * np.sin(20.0 * TIME))]))
    assert found["wave"].gain == pytest.approx(3.0**2 * 2000 / 4, rel=0.06)
    assert found["cube"].gain < 10.0
    (start,) = found["wave"].starts.values()
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
    (start,) = found["cube"].starts.values()
    assert start.values["b"] == pytest.approx(-0.5, abs=0.05)


@pytest.mark.parametrize("plausible", [0.1, 0.33])
def test_a_delay_that_stood_for_a_filter_is_unbent(plausible: float) -> None:
    """The filter delays by 0.1 nearly: the delay, truly 0.05, stands for it at first.

    Fits begin at the plausible size and at 0.3 of it. No delay makes room for a filter of 0.33.
    """
    model = Late([noisy(late_pulses(0.05, 0.1))], plausible)
    base = fit(model, (), (0,), {"a": 0.0, "b": 0.15}, [{}])
    assert base.values["b"] > 0.14
    (found,) = fit_by_secants(model, SecantFits(base, (0,), ("lag",), {}, 3))
    (start,) = found.starts.values()
    assert start.values["b"] == pytest.approx(0.05, abs=0.005)
    assert start.values["lag_size"] == pytest.approx(0.1, abs=0.005)
