"""The search for effects of an axis believes no set that physics forbids."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.axis.effects import LIBRARY
from plant_emulator.diagnosis.axis.search import AxisSearch
from plant_emulator.diagnosis.axis.start import best_width, prepared, start
from tests.plant_emulator.diagnosis import axis_truth as truth

Extra = Callable[..., np.ndarray]


def searched(extra: Extra) -> AxisSearch:
    """A search in a run with an extra force."""
    runs, scale = prepared([truth.log(extra)])
    width = best_width(runs, scale, ())
    scale = replace(scale, width=width)
    regression, _, library = start(runs, scale, 1, LIBRARY, width)
    search = AxisSearch(regression=regression, candidates=library, scale=scale)
    search.run()
    return search


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "size", "extra"),
    [
        ("quadratic_drag", -300.0, lambda q, v, a: -300.0 * v * np.abs(v)),
        ("load_friction", 3.0, lambda q, v, a: 3.0 * truth.MASS * np.abs(a) * np.sign(v)),
    ],
)
def test_a_size_that_cannot_be_is_not_believed(name: str, size: float, extra: Extra) -> None:
    """A drag that pushes, and a friction above the force that it grows with."""
    search = searched(extra)
    (found,) = (f for names, f in search.sets.items() if names == {name})
    assert found.sizes(found.terms[0])[0][0] == pytest.approx(size, rel=0.1)
    assert "physics forbids" in search.doubt(found, found.terms[0])
    assert all(name not in one.names for one in search.believed())
