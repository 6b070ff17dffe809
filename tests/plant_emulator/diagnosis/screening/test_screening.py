"""Gains that regressions and short fits promise, on machines that can be checked by hand."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.screening.screening import OBSERVER, SIMULATION, regressions
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import TIME, Line, noisy, runner
from tests.plant_emulator.diagnosis.screening.warm import SIZE, START, STATES, Warm


@pytest.mark.parametrize("score", [SIMULATION, OBSERVER])
def test_state_that_a_size_multiplies_is_fitted(score: str) -> None:
    """By hand: a sine takes half of its squared amplitude, and the gain is half of that."""
    model, amplitudes = Warm(), [SIZE * (own - START) for own in STATES]
    null = fit_null(model, (0, 1))
    (promise,) = regressions(runner(model), null, ("warm",), (score,))
    assert promise.gain == pytest.approx(sum(0.25 * a**2 * len(TIME) for a in amplitudes), rel=0.15)
    start = promise.starts[score]
    reached = [start.values["warm_size"] * (own["warm_state"] - START) for own in start.states]
    assert reached == pytest.approx(amplitudes, abs=0.15)


class Edge(Line):
    """A steep edge that a parameter shifts; the effect shifts it too, and adds a wave."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            size = v["wave_size"] if effects else 0.0
            edge = 100.0 * np.clip((TIME - v["a"] - size) / 0.01, 0.0, 1.0)
            return (self.measured[run] - edge - size * np.sin(20.0 * TIME))[None, :]

        return residual


def test_parameter_that_follows_an_effect_at_a_contact_leaves_the_rest_of_its_gain() -> None:
    """By hand: a wave of 0.4 gains 2000 * 0.4^2 / 4 = 80, less log(sqrt(1000)) = 3.5 for its size.

    A column over 0.3 has the edge at other samples than the slopes of the parameter have.
    """
    edge = 100.0 * np.clip((TIME - 0.1) / 0.01, 0.0, 1.0)
    model = Edge([noisy(edge + 0.4 * np.sin(20.0 * TIME))], ["wave"])
    near = replace(fit_null(Line([noisy(TIME)]), (0,)), values={"a": 0.1, "b": 0.0}, lengths={})
    (promise,) = regressions(runner(model), near, ("wave",), (SIMULATION,))
    assert promise.gain == pytest.approx(76.5, rel=0.25)
    assert promise.starts[SIMULATION].values["wave_size"] == pytest.approx(0.4, abs=0.1)
    assert promise.starts[SIMULATION].values["a"] == pytest.approx(-0.3, abs=0.1)


class Bent(Line):
    """An effect that grows with the square of its size, and has a wave as its slope."""

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            size = v["kink_size"] if effects else 0.0
            bend = 40.0 * size**2 * abs(TIME) + 0.1 * size * np.sin(20.0 * TIME)
            return (self.measured[run] - v["a"] - v["b"] * TIME - bend)[None, :]

        return residual


def test_effect_whose_slope_is_another_change_is_promised_by_its_column() -> None:
    """By hand: a kink of 3.6, as of the size 0.3, gains 2000 * 3.6^2 / 24 = 1080."""
    model = Bent([noisy(2.0 + 3.0 * TIME + 3.6 * abs(TIME))], ["kink"])
    null = fit_null(model, (0,))
    (promise,) = regressions(runner(model), null, ("kink",), (SIMULATION,))
    assert promise.gain == pytest.approx(1080.0, rel=0.1)
    assert promise.starts[SIMULATION].values["kink_size"] == pytest.approx(0.3, abs=0.02)
