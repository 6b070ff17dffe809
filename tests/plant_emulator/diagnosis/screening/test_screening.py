"""Gains that regressions and short fits promise, on machines that can be checked by hand."""

import pytest

from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.screening.screening import OBSERVER, SIMULATION, regressions
from tests.plant_emulator.diagnosis.line import TIME, runner
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
