"""The residual of the simulation around a fit, and what effects do to it."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.joint_fit import linearise
from plant_emulator.estimation.regression import Regression
from plant_emulator.estimation.simulated_problem import DIFFERENCE_NORM

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.fidelity import Values
    from plant_emulator.diagnosis.fit_result import FitValues
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.estimation.unknowns import Unknown
    from plant_emulator.signals.log import Array


class SimulationColumns:
    """The residual of the simulation, free or led, and its tangents; see `Fidelity`.

    beside : whether a column is taken where the nuisance makes up for the effect. Where the effect
        or a parameter moves alone, a contact comes or goes, and columns bend
    """

    def __init__(
        self,
        model: Model,
        where: FitValues,
        runs: Sequence[int],
        difference: float = DIFFERENCE_NORM,
        *,
        beside: bool = False,
    ) -> None:
        self.beside = beside
        self.model, self.where, self.runs = model, where, tuple(runs)
        self.found = linearise(model, where, runs, difference)
        self.base = np.concatenate([r.ravel() for r in self.found.residuals])
        self._rough = model.rough()
        self._plain = self._residual(where.effects, {}, [{} for _ in runs])

    def _residual(
        self,
        effects: Sequence[str],
        sizes: Mapping[str, float],
        states: Sequence[Mapping[str, float]],
    ) -> Array:
        """Rough residual at the fit with these effects, shape (n,)."""
        parts = [
            self._rough.residual(k, effects)({**self.where.values, **own, **more, **sizes}).ravel()
            for k, own, more in zip(self.runs, self.where.states, states, strict=True)
        ]
        return np.concatenate(parts)

    @cached_property
    def data(self) -> Regression:
        """Data and nuisance; an unknown without a prior gets one of a deviation of 1."""
        slopes = np.concatenate([j.reshape(-1, len(self.found.z)) for j in self.found.jacobians])
        shift = -self._coefficients * self.deviations
        return Regression.of(self.base + slopes @ shift, -slopes * self.deviations)

    @cached_property
    def _coefficients(self) -> Array:
        """Nuisance coefficients at the fit, shape (k,)."""
        return np.array([z - self._prior(u, z) for u, z in self._pairs()]) / self.deviations

    @cached_property
    def deviations(self) -> Array:
        """Prior standard deviations on the scale of the estimation."""
        return np.array([u.scaled_std if u.std else 1.0 for u, _ in self._pairs()])

    @staticmethod
    def _prior(unknown: Unknown, z: float) -> float:
        """Prior mean on the scale of the estimation; that of the fit where there is no prior."""
        return unknown.scaled(unknown.prior) if unknown.std else z

    def _pairs(self) -> list[tuple[Unknown, float]]:
        return [(u, float(z)) for u, z in zip(self.found.unknowns, self.found.z, strict=True)]

    @cached_property
    def owners(self) -> NDArray[np.int_]:
        """See `Fidelity`."""
        return np.repeat(np.arange(len(self.runs)), [r.size for r in self.found.residuals])

    def column(
        self, effect: str, sizes: Mapping[str, float], states: Sequence[Mapping[str, float]]
    ) -> Array | None:
        """See `Fidelity`."""
        change = self.unwhitened(effect, sizes, states)
        if not self.beside:
            return change
        at = self._coefficients - self.data.follow(change)
        values, moved = self.values_at(at)
        there = [{**own, **more} for own, more in zip(moved, states, strict=True)]
        # What the nuisance does there is taken off again: it has columns of its own.
        nuisance = self.data.nuisance @ (self._coefficients - self._within(at))
        return self.unwhitened(effect, {**values, **sizes}, there) + nuisance

    def unwhitened(
        self, effect: str, sizes: Mapping[str, float], states: Sequence[Mapping[str, float]]
    ) -> Array:
        """See `Fidelity`."""
        return self._plain - self._residual((*self.where.effects, effect), sizes, states)

    def values_at(self, theta: Array) -> Values:
        """See `Fidelity`."""
        values: dict[str, float] = {}
        states: list[dict[str, float]] = [{} for _ in self.runs]
        coefficients = self._within(theta) * self.deviations
        for (u, z), off in zip(self._pairs(), coefficients, strict=True):
            value = u.value(self._prior(u, z) + float(off))
            (values if u.run is None else states[u.run])[u.name] = value
        return values, states

    def _within(self, theta: Array) -> Array:
        """Nuisance coefficients within the bounds of their unknowns, shape (k,)."""
        bounds = [
            (u.scaled(u.lower) - self._prior(u, z), u.scaled(u.upper) - self._prior(u, z))
            for u, z in self._pairs()
        ]
        lower, upper = np.array(bounds).T / self.deviations
        return np.clip(theta, lower, upper)

    def confounded_with(self, column: Array) -> str:
        """The unknown that follows a change of the data most."""
        shift = self.data.follow(column)
        lengths = np.linalg.norm(self.data.nuisance, axis=0)
        return self.found.unknowns[int(np.argmax(np.abs(shift) * lengths))].name
