"""The search for effects of an axis believes no set that physics forbids."""

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.axis.effects import LIBRARY
from plant_emulator.diagnosis.axis.search import AxisSearch
from plant_emulator.diagnosis.axis.start import best_width, prepared, start
from tests.plant_emulator.diagnosis import axis_truth as truth


@pytest.mark.slow
def test_a_drag_that_pushes_is_not_believed() -> None:
    runs, scale = prepared([truth.log(lambda q, v, a: -300.0 * v * np.abs(v))])
    width = best_width(runs, scale, ())
    scale = replace(scale, width=width)
    regression, _, library = start(runs, scale, 1, LIBRARY, width)
    search = AxisSearch(regression=regression, candidates=library, scale=scale)
    search.run()
    (drag,) = (f for names, f in search.sets.items() if names == {"quadratic_drag"})
    assert drag.sizes(drag.terms[0])[0][0] == pytest.approx(-300.0, rel=0.05)
    assert "physics forbids" in search.doubt(drag, drag.terms[0])
    assert all("quadratic_drag" not in found.names for found in search.believed())
