"""Fits that converge in a narrow minimum of a cost with many of them."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pytest

from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import TIME, Line, noisy


class Rippled(Line):
    """y = a + 0.05 sin(60 a) + b x: each period of the ripple, 0.1 of a, has a minimum."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""
        plain = super().residual(run, effects)

        def residual(v: Mapping[str, float]) -> Array:
            return plain({**v, "a": v["a"] + 0.05 * np.sin(60.0 * v["a"])})

        return residual


@pytest.mark.parametrize("start", [1.5, 1.8, 2.25])
def test_converged_fit_is_led_out_of_a_narrow_minimum(start: float) -> None:
    """The level is 2, with a standard error of 0.02; the minima beside hide 1 % and 18 %."""
    model = Rippled([noisy(2.0 + 3.0 * TIME)])
    begun = {"a": start, "b": 3.0}
    stalled = fit(model, (), (0,), begun, [{}], over_kinks=False)
    found = fit(model, (), (0,), begun, [{}])

    def level(values: Mapping[str, float]) -> float:
        return values["a"] + 0.05 * float(np.sin(60.0 * values["a"]))

    assert stalled.converged
    assert abs(level(stalled.values) - 2.0) > 0.1
    assert level(found.values) == pytest.approx(2.0, abs=0.08)
    assert found.converged
