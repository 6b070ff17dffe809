"""Sizes, shapes and nominal parameters of a fit, with standard errors and units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.answer import Quantity
from plant_emulator.diagnosis.axis.regression.fit import NAMES, residual
from plant_emulator.diagnosis.axis.regression.rows import Term

if TYPE_CHECKING:
    from plant_emulator.diagnosis.axis.regression.fit import Fit, Regression
    from plant_emulator.signals.log import Array

UNITS = {
    False: dict(zip(NAMES, ("kg", "N s/m", "N", "N"), strict=True)),
    True: dict(zip(NAMES, ("kg m^2", "N m s/rad", "N m", "N m"), strict=True)),
}
# Nominal friction of which an effect tells one value of each direction.
BY_DIRECTION = {"viscous_asymmetry": 1, "coulomb_asymmetry": 2}
# Step of a shape for its derivative, in the logarithm.
STEP = 0.02


def quantities(regression: Regression, found: Fit, term: Term) -> tuple[Quantity, ...]:
    """Sizes, shapes, and what the field knows the effect by, of one effect of a fit."""
    rotary = regression.rows[0].scale.rotary
    name = term.effect.name
    covariance = _covariance(regression, found)
    first = found.place(term)
    told = [
        Quantity(
            name=f"{name}_{size.name}",
            value=float(found.values[first + k]),
            standard_error=_error(covariance, first + k),
            unit=size.unit[rotary],
        )
        for k, size in enumerate(term.effect.sizes)
    ]
    place = len(found.values)
    for other in found.terms:
        for shape, value in zip(other.effect.shapes, other.shapes, strict=True):
            if other == term:
                error = value * _error(covariance, place)
                unit = shape.unit[rotary]
                told.append(
                    Quantity(
                        name=f"{name}_{shape.name}", value=value, standard_error=error, unit=unit
                    )
                )
            place += 1
    return (*told, *_by_direction(found, covariance, term, rotary=rotary))


def _by_direction(
    found: Fit, covariance: Array, term: Term, *, rotary: bool
) -> tuple[Quantity, ...]:
    """Friction forwards and backwards, of an effect that differs by direction."""
    friction = BY_DIRECTION.get(term.effect.name)
    if friction is None:
        return ()
    place = found.place(term)
    part = covariance[np.ix_([friction, place], [friction, place])]
    return tuple(
        Quantity(
            name=way,
            value=float(found.values[friction] + sign * found.values[place]),
            standard_error=float(np.sqrt(part[0, 0] + part[1, 1] + 2.0 * sign * part[0, 1])),
            unit=UNITS[rotary][NAMES[friction]],
        )
        for way, sign in (("forwards", 1.0), ("backwards", -1.0))
    )


def _error(covariance: Array, k: int) -> float:
    return float(np.sqrt(max(0.0, covariance[k, k])))


def _covariance(regression: Regression, found: Fit) -> Array:
    """Covariance of the values and of the logarithms of the shapes (Gauss and Newton)."""
    slopes = []
    for k, term in enumerate(found.terms):
        for j, value in enumerate(term.shapes):
            sides = []
            for sign in (1.0, -1.0):
                shapes = list(term.shapes)
                shapes[j] = value * float(np.exp(sign * STEP))
                moved = (*found.terms[:k], Term(term.effect, tuple(shapes)), *found.terms[k + 1 :])
                sides.append(_residuals(regression, found, moved))
            slopes.append((sides[1] - sides[0]) / (2.0 * STEP))
    if not slopes:
        return found.covariance
    designs = [rows.design(found.terms, found.reference) for rows in regression.rows]
    whole = np.column_stack([np.concatenate(designs), *slopes])
    scatter = found.cost / found.count / regression.independent
    return np.asarray(np.linalg.pinv(whole.T @ whole, hermitian=True) * scatter)


def _residuals(regression: Regression, found: Fit, terms: tuple[Term, ...]) -> Array:
    from dataclasses import replace

    other = replace(found, terms=terms)
    return np.concatenate(
        [
            residual(rows, other, regression.base, level)
            for rows, level in zip(regression.rows, found.levels, strict=True)
        ]
    )
