"""The residual of a set of effects on held-out runs.

A fold fits some runs and predicts others. A predicted run keeps all values but its own friction
level, which is known as well as that of a fitted run.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.effects import TIMING
from plant_emulator.diagnosis.axis.regression.fit import residual
from plant_emulator.diagnosis.axis.regression.rows import Term
from plant_emulator.diagnosis.prediction import block_bootstrap

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.axis.regression.fit import Regression
    from plant_emulator.diagnosis.axis.regression.rows import Rows
    from plant_emulator.signals.log import Array

    Folds = Sequence[tuple[tuple[int, ...], tuple[int, ...]]]


@dataclass(frozen=True, kw_only=True)
class Share:
    """Share by which an error falls [1], and its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """The folds of a diagnosis.

    rows : of all runs; regression : of the fitted runs, whose noise and reference all folds share
    """

    rows: Sequence[Rows]
    regression: Regression
    folds: Folds
    known: dict[object, list[Array]] = field(default_factory=dict)

    @property
    def runs(self) -> list[int]:
        """Numbers of the predicted runs, in the order of the errors."""
        return [run for _, predicted in self.folds for run in predicted]

    def errors(self, terms: Sequence[Term], *, timing: bool = False) -> list[Array]:
        """Force that a prediction misses, one array of rows a predicted run.

        timing : whether the stamps of force and motion may differ
        """
        terms = (*terms, Term(TIMING)) if timing else tuple(terms)
        key = tuple(t.key for t in terms)
        if key not in self.known:
            self.known[key] = [e for fold in self.folds for e in self._fold(*fold, terms)]
        return self.known[key]

    def measured(self) -> list[Array]:
        """Averaged force of the predicted runs, as it was logged."""
        return [self.rows[run].logged() for run in self.runs]

    def nominal_errors(self, values: Sequence[float]) -> list[Array]:
        """Force that nominal parameters as they are given miss, one array of rows a run."""
        return [self.rows[run].force(()) - self.rows[run].nominal() @ values for run in self.runs]

    def recalibrated(self, values: Sequence[float]) -> Share:
        """Share by which the error falls where given nominal parameters are estimated again."""
        return _share(self.errors(()), self.nominal_errors(values))

    def relative(self, terms: Sequence[Term], *, timing: bool = False) -> float:
        """norm(e) / norm(y) over all predicted runs [1]."""
        error = np.concatenate(self.errors(terms, timing=timing))
        return float(np.linalg.norm(error) / np.linalg.norm(np.concatenate(self.measured())))

    def share(
        self, terms: Sequence[Term], reference: Sequence[Term], *, timing: bool = False
    ) -> Share:
        """Share by which the rms of the error falls from a reference to these terms."""
        after, before = (self.errors(t, timing=timing) for t in (terms, reference))
        return _share(after, before, self._removed(terms) - self._removed(reference))

    def own_inertia(self) -> Share:
        """Share by which the error falls where each predicted run has an inertia of its own."""
        before = self.errors(())
        accelerations = [self.rows[run].nominal()[:, 0] for run in self.runs]
        after = [
            e - a * float(a @ e) / float(a @ a) for e, a in zip(before, accelerations, strict=True)
        ]
        return _share(after, before)

    def _removed(self, terms: Sequence[Term]) -> float:
        """Squares of the force's noise that a delay or lag takes away, which explains nothing."""
        return sum(self.rows[k].noise(()) - self.rows[k].noise(terms) for k in self.runs)

    def _fold(
        self, fitted: Sequence[int], predicted: Sequence[int], terms: Sequence[Term]
    ) -> list[Array]:
        own = replace(self.regression, rows=[self.rows[k] for k in fitted])
        found = own.fit(terms)
        return [
            residual(self.rows[k], found, own.base, own.own_level(self.rows[k], found))
            for k in predicted
        ]


def _share(after: Sequence[Array], before: Sequence[Array], removed: float = 0.0) -> Share:
    """Share by which the rms of errors falls, one array of rows a run.

    removed : squares that are missing after, and count as left
    """
    lengths = [block_bootstrap.block_length(e[None]) for e in before]
    drawn = [
        block_bootstrap.resampled_sums([e[None] ** 2 for e in errors], lengths)[0]
        for errors in (after, before)
    ]
    left = np.maximum(drawn[0] + removed, 0.0)
    low, high = np.quantile(1.0 - np.sqrt(left / drawn[1]), [0.025, 0.975])
    whole = [sum(float(e @ e) for e in errors) for errors in (after, before)]
    value = 1.0 - float(np.sqrt(max(whole[0] + removed, 0.0) / whole[1]))
    return Share(value=value, low=float(low), high=float(high))
