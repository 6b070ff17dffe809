"""The identification against a general estimator (lmfit) and a general solver (scipy's LSODA)."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from plant_emulator.identification.identify import FINAL_TOLERANCE

if TYPE_CHECKING:
    from plant_emulator.identification.identify import Identification

TOOLS = str(Path(__file__).resolve().parents[2] / "tools")


@pytest.fixture(scope="module")
def fits() -> Any:
    """The log of the comparison, prepared for both ways."""
    sys.path.insert(0, TOOLS)
    try:
        from benchmark.fits import Fits
    finally:
        sys.path.remove(TOOLS)
    return Fits()


@pytest.fixture(scope="module")
def ours(fits: Any) -> Identification:
    """Our optimum."""
    found: Identification = fits.ours()
    return found


def test_another_solver_finds_the_same_cost_at_our_optimum(fits: Any, ours: Identification) -> None:
    values = {p.name: p.value for p in ours.parameters}
    residual = fits.residual(values, ours.gap_positions[0])
    assert np.sum(residual**2) == pytest.approx(ours.estimate.cost, rel=2e-4)


def test_another_estimator_ends_at_our_optimum(fits: Any, ours: Identification) -> None:
    """lmfit's leastsq is MINPACK's Levenberg-Marquardt with its own differences, here in factors
    on our values; in their logarithms it stopped 0.06 above our sum of squares.

    It may stand still before its optimum: where, depends on the processor's last digits. The better
    end of two starts is compared. It is ours to four digits, but for what the log says so little of
    that a tenth of its standard error is more than that, and in the sum of squares to what such a
    distance is worth, 0.1^2.
    """
    theirs = min(
        (_theirs(fits, ours, apart) for apart in (0.002, 0.03)), key=lambda one: one.chisqr
    )
    assert theirs.chisqr == pytest.approx(ours.estimate.cost, abs=0.1**2)
    for p in ours.parameters:
        value = p.value * theirs.params[p.name].value
        assert value == pytest.approx(p.value, abs=max(1e-4 * p.value, 0.1 * p.standard_error))


def _theirs(fits: Any, ours: Identification, apart: float) -> Any:
    """What leastsq finds from our values, off by so much to either side in turn."""
    import lmfit

    unknowns = lmfit.Parameters()
    for k, p in enumerate(ours.parameters):
        unknowns.add(p.name, value=1.0 + apart * (-1) ** k)
    unknowns.add("gap_position", value=ours.gap_positions[0] + apart, min=-1.0, max=1.0)

    def residual(trial: Any) -> np.ndarray:
        values = {p.name: p.value * trial[p.name].value for p in ours.parameters}
        gap = float(trial["gap_position"].value)
        own = {**fits.nominal.values(), **values}
        return np.asarray(fits.recording.residual(own, gap, FINAL_TOLERANCE).ravel())

    return lmfit.minimize(
        residual, unknowns, method="leastsq", epsfcn=1e-10, ftol=1e-12, xtol=1e-12
    )
