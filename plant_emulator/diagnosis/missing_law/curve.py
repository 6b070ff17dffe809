"""The missing law as a curve over one state, without a formula.

A curve is a sum of linear splines over one state. The regression gives its coefficients and their
covariance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.answer import Curve
from plant_emulator.diagnosis.localisation.linear_splines import linear_splines
from plant_emulator.diagnosis.missing_law.reduced import products

if TYPE_CHECKING:
    from plant_emulator.diagnosis.missing_law.quantity import LawQuantity
    from plant_emulator.diagnosis.missing_law.reduced import LawRows
    from plant_emulator.diagnosis.missing_law.states import LawState
    from plant_emulator.signals.log import Array

# Knots of a curve, at quantiles of its state; between the first and the last one all runs lie.
KNOTS = 9
# Half of the 95 % interval of a normal distribution [standard deviations].
HALF_INTERVAL = 1.96


def curve(rows: LawRows, quantity: LawQuantity, state: LawState) -> Curve:
    """The curve of a quantity over a state, fitted to all runs."""
    knots = knots_of(state)
    columns = rows.of([linear_splines(own, knots) for own in state.values])
    p = products(rows.runs, columns)
    every, chosen = range(len(columns)), range(len(knots))
    found = p.coefficients(chosen, every)
    left = 2.0 * sum(p.run_loss(chosen, found, k) for k in every)
    excess = max(1.0, left / sum(len(own.y) for own in rows.runs))
    errors = np.sqrt(excess * np.diag(p.covariance(chosen, every)))
    return Curve(
        quantity=quantity.name,
        unit=quantity.unit,
        over=state.name,
        over_unit=state.unit,
        knots=tuple(knots.tolist()),
        values=tuple((found[p.shared :] / p.scale).tolist()),
        band=tuple((HALF_INTERVAL * errors / p.scale).tolist()),
    )


def knots_of(state: LawState) -> Array:
    """Knots at quantiles of the state's values, the ends included, each one once."""
    values = np.concatenate(list(state.values))
    return np.unique(np.quantile(values, np.linspace(0.0, 1.0, KNOTS)))
