"""Beforehand: how large an effect of an axis has to be to show in some runs.

A law enters the regression of the averaged force linearly. What nominal parameters and the friction
of each run can follow of it is projected out; the rest, in the noise that a rich model leaves, is
its information. The smallest size reaches the gain of log evidence that the search asks for, and
closes the share of the error that the verdict asks for. A shape lies in the middle of its bounds,
and a force that is replaced counts by its change for a second. Plausible is a law whose rms is a
tenth of the force's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.effects import LIBRARY
from plant_emulator.diagnosis.axis.settings import SETTINGS
from plant_emulator.diagnosis.axis.start import best_width, middle_term, prepared, start
from plant_emulator.diagnosis.design.detectability import EffectDetectability

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.axis.effects import Effect, Shape, Size
    from plant_emulator.diagnosis.axis.effects.effect import Scale
    from plant_emulator.diagnosis.axis.regression.fit import Regression
    from plant_emulator.diagnosis.axis.regression.rows import Rows
    from plant_emulator.signals.axis_log import AxisLog
    from plant_emulator.signals.log import Array

# Rms of a plausible law, in that of the force; larger than the force no law is.
PLAUSIBLE, LARGEST = 0.1, 1.0


@dataclass(frozen=True, kw_only=True)
class _Law:
    """An effect in the runs, per unit of its sizes.

    own : columns less what the nominal parameters follow, shape (rows, sizes), in the noise
    rms : of each whole column [N or N m per unit]
    """

    effect: Effect
    own: Array
    rms: Array

    def plausible(self, force: float) -> Array:
        """Own part of the plausible law, shape (rows,)."""
        sizes = PLAUSIBLE * force / (self.rms * np.sqrt(len(self.rms)))
        return np.asarray(self.own @ sizes)


def detection_limits(logs: Sequence[AxisLog]) -> list[EffectDetectability]:
    """What these runs show together of each effect, the one that shows best first.

    Raises LogError for a run that is too short or does not move.
    """
    runs, scale = prepared(logs)
    width = best_width(runs, scale, ())
    scale = replace(scale, width=width)
    regression, rows, library = start(runs, scale, len(runs), LIBRARY, width)
    followed = np.concatenate([one.nominal() for one in rows])
    if len(rows) > 1:
        followed = np.concatenate([followed, _own_friction(regression, rows)], axis=1)
    basis = np.linalg.qr(followed)[0]
    noise = np.sqrt(regression.variance / regression.independent)
    laws = [_law(effect, _columns(regression, rows, effect), basis, noise) for effect in library]
    found = [_limit(law, laws, regression, scale) for law in laws]
    there = {one.name for one in library}
    missing = {one.name: one for one in LIBRARY if one.name not in there}
    ranked = sorted(found, key=lambda one: -one.evidence_at_plausible_size)
    return [*ranked, *map(_absent, missing.values())]


def _own_friction(regression: Regression, rows: Sequence[Rows]) -> Array:
    """Friction of each run by itself, shape (rows, runs)."""
    from scipy.linalg import block_diag

    return np.asarray(block_diag(*(one.own(regression.base)[:, :1] for one in rows)))


def _columns(regression: Regression, rows: Sequence[Rows], effect: Effect) -> Array:
    """Averaged law of an effect in all runs, shape (rows, sizes), per unit of its sizes."""
    term = middle_term(effect, rows[0].scale)
    if effect.columns is not None:
        return np.concatenate([one.columns(term, regression.base) for one in rows])
    changes = [one.force(()) - one.force((term,)) for one in rows]
    return np.concatenate(changes)[:, None] / term.shapes[0]


def _law(effect: Effect, columns: Array, basis: Array, noise: float) -> _Law:
    own = columns - basis @ (basis.T @ columns)
    return _Law(effect=effect, own=own / noise, rms=np.sqrt(np.mean(columns**2, axis=0)))


def _limit(
    law: _Law, laws: Sequence[_Law], regression: Regression, scale: Scale
) -> EffectDetectability:
    effect, plausible = law.effect, law.plausible(scale.force)
    linear: Sequence[Size | Shape] = effect.sizes or effect.shapes[:1]
    count = regression.independent * len(plausible)
    needed = SETTINGS.needed + 0.5 * len(effect.constants) * np.log(count)
    errors = np.sqrt(np.diag(np.linalg.pinv(law.own.T @ law.own, hermitian=True)))
    # An error falls by the share w where the law's square is (1 - w)^-2 - 1 of the noise's.
    closed = np.sqrt(((1.0 - SETTINGS.worth) ** -2 - 1.0) * count / np.sum(law.own**2, axis=0))
    smallest = np.maximum(np.sqrt(2.0 * needed) * errors, closed)
    largest = LARGEST * scale.force / law.rms
    if not effect.sizes:
        smallest = np.maximum(smallest, effect.shapes[0].bounds(scale)[0])
    shows = smallest <= largest
    alike = [
        other.effect.name
        for other in laws
        if other is not law and 0.5 * _apart(plausible, other.own) < SETTINGS.margin
    ]
    return EffectDetectability(
        effect=effect.name,
        subsystem=effect.subsystem,
        smallest_size={
            one.name: float(size) if there else None
            for one, size, there in zip(linear, smallest, shows, strict=True)
        },
        hidden_up_to={
            one.name: float(size)
            for one, size, there in zip(linear, largest, shows, strict=True)
            if not there
        },
        units={one.name: one.unit[scale.rotary] for one in linear},
        evidence_at_plausible_size=float(plausible @ plausible),
        indistinguishable=(effect.name, *alike),
        needs=None if shows.any() else effect.needs or None,
    )


def _apart(law: Array, other: Array) -> float:
    """Squares of a law that another one does not follow, in the noise."""
    rest = law - other @ np.linalg.lstsq(other, law, rcond=None)[0]
    return float(rest @ rest)


def _absent(effect: Effect) -> EffectDetectability:
    """An effect whose channels the runs do not have."""
    return EffectDetectability(
        effect=effect.name,
        subsystem=effect.subsystem,
        smallest_size={one.name: None for one in effect.constants},
        hidden_up_to={},
        units={one.name: one.unit[0] for one in effect.constants},
        evidence_at_plausible_size=0.0,
        indistinguishable=(effect.name,),
        needs=effect.needs or "a channel that these runs do not have",
    )
