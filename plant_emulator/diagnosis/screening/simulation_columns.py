"""The residual of the simulation around a fit, and what effects do to it."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.fitting.joint_fit import linearise
from plant_emulator.diagnosis.fitting.signature import values_at_size
from plant_emulator.estimation.least_squares import linearise_at
from plant_emulator.estimation.nearby import Beside
from plant_emulator.estimation.regression import Regression

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.fidelity import Values
    from plant_emulator.diagnosis.fit_result import FitValues
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.estimation.unknowns import Unknown
    from plant_emulator.signals.log import Array

# Norm of a change that the noise hides [1].
HIDDEN_NORM = 1.0


class SimulationColumns:
    """The residual of the simulation, free or led, and its tangents; see `Fidelity`."""

    def __init__(self, model: Model, where: FitValues, runs: Sequence[int]) -> None:
        """Linearise the residual at a fit."""
        self.model, self.where, self.runs = model, where, tuple(runs)
        self._known: dict[tuple[object, ...], Array] = {}
        self.found = linearise(model, where, runs)
        self.base = np.concatenate([r.ravel() for r in self.found.residuals])

    def _residual(
        self,
        effects: Sequence[str],
        sizes: Mapping[str, float],
        states: Sequence[Mapping[str, float]],
    ) -> Array:
        """Residual at the fit with these effects, shape (n,)."""
        parts = [
            self.model.residual(k, effects)({**self.where.values, **own, **more, **sizes}).ravel()
            for k, own, more in zip(self.runs, self.where.states, states, strict=True)
        ]
        return np.concatenate(parts)

    @cached_property
    def data(self) -> Regression:
        """Data and nuisance; an unknown without a prior gets one of a deviation of 1."""
        slopes = self._slopes
        return Regression.of(self.base - slopes @ self._shift, -slopes * self.deviations)

    @cached_property
    def _slopes(self) -> Array:
        """Slopes of the residual, shape (n, unknowns)."""
        return np.concatenate([j.reshape(-1, len(self.found.z)) for j in self.found.jacobians])

    @cached_property
    def _shift(self) -> Array:
        """Distance of the fit from the prior means, on the scale of the estimation."""
        return np.array([z - self._prior(u, z) for u, z in self._pairs()])

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
        return self.base - self._residual((*self.where.effects, effect), sizes, states)

    # No slopes: those of all effects together follow a seventh of the noise in recordings of the
    # gateway.
    unwhitened = column

    def slope(self, effect: str, size: str, states: Sequence[Mapping[str, float]]) -> Array:
        """Change of the data by a plausible size of an effect, as its slope at neutral tells, (n,).

        The slope is taken over as little as those of the parameters. A column over more is another
        one where a contact falls on a sample, and no parameter follows it there.

        size : name of the size parameter, the others are neutral
        """
        key = (effect, size, *(tuple(sorted(own.items())) for own in states))
        if key not in self._known:
            self._known[key] = self._slope(effect, size, states)
        return self._known[key]

    def _slope(self, effect: str, size: str, states: Sequence[Mapping[str, float]]) -> Array:
        candidate = self.model.candidates[effect]
        (unknown,) = (u for u in candidate.sizes if u.name == size)
        neutral = candidate.neutral[size]
        beside = {**self.where.values, **values_at_size(candidate, 0.0)}
        residuals = [
            Beside(self.model.residual(k, (*self.where.effects, effect)), {**beside, **own, **more})
            for k, own, more in zip(self.runs, self.where.states, states, strict=True)
        ]
        found = linearise_at([replace(unknown, start=neutral)], residuals)
        away = unknown.scaled(neutral) - unknown.scaled(unknown.start)
        return away * np.concatenate([j.ravel() for j in found.jacobians])

    def values_at(self, theta: Array) -> Values:
        """See `Fidelity`."""
        values: dict[str, float] = {}
        states: list[dict[str, float]] = [{} for _ in self.runs]
        for (u, z), t, std in zip(self._pairs(), theta, self.deviations, strict=True):
            scaled = self._prior(u, z) + std * float(t)
            scaled = float(np.clip(scaled, u.scaled(u.lower), u.scaled(u.upper)))
            (values if u.run is None else states[u.run])[u.name] = u.value(scaled)
        return values, states

    def confounded_with(self, column: Array) -> str:
        """The unknown that follows a change of the data most."""
        shift = self.data.follow(column)
        lengths = np.linalg.norm(self.data.nuisance, axis=0)
        return self.found.unknowns[int(np.argmax(np.abs(shift) * lengths))].name
