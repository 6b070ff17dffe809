"""The whitened parity relations of a bench around a fit, and the responses of effects in them.

The rows are those of `BlockRegression`: the relations of all runs, then the drum speeds behind the
measured motor speed. A column is the difference of two simulated logs, with and without the effect,
that went through the same relations. No law is so written twice.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from plant_emulator.diagnosis.localisation.block_regression import BlockRegression
from plant_emulator.diagnosis.localisation.drum_subsystem import prior_means
from plant_emulator.diagnosis.localisation.measured_signals import NOISES
from plant_emulator.diagnosis.localisation.parity_relations import (
    DRIVE,
    GEAR,
    ROWS,
    relation_residuals,
)
from plant_emulator.diagnosis.machines.thinning import thin
from plant_emulator.diagnosis.screening.rich_model import rich_columns
from plant_emulator.errors import UnsettledError
from plant_emulator.estimation.noise.channel_noise import LINE_PRIOR
from plant_emulator.estimation.noise.estimate import estimate_channel_noise
from plant_emulator.estimation.regression import Regression
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.signals.log import Log
from plant_emulator.signals.mains import line_columns
from plant_emulator.signals.noise import NoiseSeries

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.fidelity import Values
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Candidate
    from plant_emulator.estimation.noise.channel_noise import Whitener
    from plant_emulator.estimation.unknowns import Unknown
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

FIELDS = {
    "motor_speed": "motor_speed",
    "drum_speed": "drum_speed",
    "armature_current": "current",
    "shaft_torque": "torque",
    "armature_voltage": "voltage",
}
# A parameter is started within this factor of its nominal value.
START_FACTOR = 5.0


class DiagnosedBench(Protocol):
    """The interface of a bench that `BenchRelations` uses."""

    nominal_set: ParameterSet
    candidates: Mapping[str, Candidate]
    parameters: tuple[Unknown, ...]

    def recording(self, run: int) -> Recording:
        """The recording of a run."""

    def fixed_values(self, run: int, effects: Sequence[str]) -> dict[str, float]:
        """Values that no fit of these effects changes."""

    def simulated(self, run: int, values: Mapping[str, float]) -> Log:
        """The log that a run would have given at these values of everything."""


class BenchRelations:
    """The whitened relations, and the drum driven by the measured motor speed; see `Fidelity`.

    whiteners : of the channels by run, which know what does not count, and the lines of the mains;
        None: as the recordings say
    """

    def __init__(
        self,
        model: DiagnosedBench,
        where: FitResult,
        runs: Sequence[int],
        whiteners: Mapping[int, Sequence[Whitener]] | None = None,
    ) -> None:
        self.model, self.where, self.runs = model, where, tuple(runs)
        self.channels = [(whiteners or {}).get(k, ()) for k in runs]
        self.thinned = [
            thin(r, np.stack([w.use for w in own]) if own else r.use)
            for own, r in zip(self.channels, map(model.recording, runs), strict=True)
        ]
        self.recordings = [t.recording for t in self.thinned]
        own = {u.name for u in model.parameters}
        drift = replace(where, values={k: v for k, v in where.values.items() if k in own})
        self.site = BlockRegression(self.recordings, model.nominal_set, drift)
        self._known: dict[tuple[object, ...], Array | None] = {}
        self._driven: dict[tuple[int, bytes], Array] = {}
        plain = self._rows((), [{}] * len(runs))
        if plain is None:
            raise UnsettledError("the fit cannot be simulated")
        self.plain = plain

    @cached_property
    def use(self) -> NDArray[np.bool_]:
        """Rows that count, shape (n,): none of the drum under a torque that nobody measured."""
        relation = [
            np.repeat(t.usable_intervals, len(r.value))
            for t, r in zip(self.thinned, self.site.relations, strict=True)
        ]
        counted = np.concatenate([*relation, *(~t.void for t in self.thinned)])
        for kind, k, rows in self._series:
            counted[rows] &= not (self.site.signals[k].unknown_torque and kind in {GEAR, -1})
        return counted

    @cached_property
    def _series(self) -> list[tuple[int, int, slice]]:
        """Number of the relation, or -1 for the drum speed, run and rows of each series."""
        sizes, found = [r.value.size for r in self.site.relations], []
        ends = np.cumsum([0, *sizes, *(len(m.time) for m in self.site.signals)]).tolist()
        for k, (r, first) in enumerate(zip(self.site.relations, ends, strict=False)):
            count, drum = len(r.value), slice(*ends[len(sizes) + k :][:2])
            found.append((-1, k, drum))
            found += [(n, k, slice(first + n, ends[k + 1], count)) for n in range(count)]
        return found

    @cached_property
    def owners(self) -> NDArray[np.int_]:
        """See `Fidelity`."""
        counts = [r.value.size for r in self.site.relations]
        samples = [len(m.time) for m in self.site.signals]
        order = np.arange(len(counts))
        return np.concatenate([np.repeat(order, counts), np.repeat(order, samples)])

    @cached_property
    def whiteners(self) -> list[tuple[slice, Whitener]]:
        """The rows of each kind in each run that has some that count, and their whitening filters.

        The noise is estimated on what a rich model leaves: see `rich_columns`.
        """
        columns = [c.T for c in (self.nuisance, *rich_columns(self.model.candidates, self))]
        rich = np.concatenate([self._data[None], *columns])
        rich[:, ~self.use] = 0.0
        rest = Regression.of(rich[0], rich[1:].T).left
        found: list[tuple[slice, Whitener]] = []
        for kind in range(-1, ROWS):
            places, series = [], []
            for own, k, rows in self._series:
                if own == kind and self.use[rows].any():
                    time = self.site.signals[k].time[0 if kind < 0 else 1 :]
                    places.append(rows)
                    series.append(NoiseSeries(time=time, value=rest[rows], use=self.use[rows]))
            if places:
                noise = estimate_channel_noise(series, disturbed=False)
                found += zip(places, noise[1], strict=True)
        return found

    def white(self, rows: Array) -> Array:
        """Whiten rows of shape (n,) in the noise that they show themselves."""
        found = np.zeros_like(rows)
        for place, whitener in self.whiteners:
            if rows[place].any():
                found[place] = whitener.innovations(rows[place])
        return found

    @cached_property
    def data(self) -> Regression:
        """Data and nuisance, whitened."""
        nuisance = np.stack([self.white(column) for column in self.nuisance.T])
        return Regression.of(self.white(self._data), nuisance.T)

    @cached_property
    def _data(self) -> Array:
        """The rows without the response of the effects of the fit."""
        y = self.site.model.y
        return y - (self._with_effects - self.plain) if self.where.effects else y

    @cached_property
    def nuisance(self) -> Array:
        """Columns of the parameters, of the mains in each channel of each run, and of the drum."""
        *parameters, drum = self.site.model.nuisance
        return np.concatenate([*parameters, *self._lines(), drum], axis=1)

    def _lines(self) -> Iterator[Array]:
        """Response of the rows to the mains lines in a channel."""
        for k, own in enumerate(self.channels):
            m, names = self.site.signals[k], self.recordings[k].channels
            plain = relation_residuals(m, self.site.values)[0]
            for name, whitener in zip(names, own, strict=bool(own)):
                noise = whitener.noise
                level = LINE_PRIOR * noise.deviation * m.noise[NOISES.index(name)]
                for column in line_columns(m.time, whitener.lines).T:
                    yield self._perturb(k, name, level * column, plain)[:, None]

    def _perturb(self, k: int, name: str, change: Array, plain: Array) -> Array:
        """Response of the rows to an error of one channel of one run, shape (n,).

        plain : residuals of the run's relations without the error
        """
        m = self.site.signals[k]
        field, none = FIELDS[name], [None] * len(self.runs)
        other = replace(m, **{field: getattr(m, field) + change})
        left = relation_residuals(other, self.site.values)[0] - plain
        speed = change / m.noise[1] if name == "drum_speed" else np.zeros(len(change))
        relation: list[Array | None] = [*none]
        drum: list[Array | None] = [*none]
        relation[k], drum[k] = left[..., None], speed[:, None]
        return self.site.rows.shared_columns(relation, drum)[:, 0]

    @cached_property
    def _with_effects(self) -> Array:
        rows = self._rows(self.where.effects, [{}] * len(self.runs))
        return self.plain if rows is None else rows

    def column(
        self, effect: str, sizes: Mapping[str, float], states: Sequence[Mapping[str, float]]
    ) -> Array | None:
        """See `Fidelity`."""
        rows = self.unwhitened(effect, sizes, states)
        return None if rows is None else self.white(rows)

    def unwhitened(
        self, effect: str, sizes: Mapping[str, float], states: Sequence[Mapping[str, float]]
    ) -> Array | None:
        """See `Fidelity`."""
        trial = [{**more, **sizes} for more in states]
        key = (effect, *(tuple(sorted(own.items())) for own in trial))
        if key not in self._known:
            rows = self._rows((*self.where.effects, effect), trial)
            self._known[key] = None if rows is None else rows - self._with_effects
        return self._known[key]

    def _rows(self, effects: Sequence[str], more: Sequence[Mapping[str, float]]) -> Array | None:
        """Rows of simulated runs in the nominal equations; None: one was not simulated."""
        relation, speed = [], []
        for k, extra in enumerate(more):
            try:
                left, drum = self._run_rows(k, effects, extra)
            except UnsettledError:
                return None
            relation.append(left[..., None])
            speed.append(drum[:, None])
        return self.site.rows.shared_columns(relation, speed)[:, 0]

    def _run_rows(
        self, k: int, effects: Sequence[str], extra: Mapping[str, float]
    ) -> tuple[Array, Array]:
        site, states = self.site, dict(self.where.states[k])
        start = {**site.fitted, GAP_POSITION: states[GAP_POSITION]}
        fixed = self.model.fixed_values(self.runs[k], effects)
        trial = {**fixed, **self.where.values, **states, **extra} if effects else start
        log, own = self._simulate(k, trial), site.signals[k]
        m = replace(
            own,
            motor_speed=log["motor_speed"],
            speed=log["motor_speed"],
            drum_speed=log["drum_speed"],
            current=log["armature_current"],
            torque=log["shaft_torque"],
            voltage=None if own.voltage is None else log["armature_voltage"],
        )
        left, limited = relation_residuals(m, site.values)
        left[DRIVE, limited] = 0.0
        # Many effects, as those of most sensors, leave the motor speed of a run as it is.
        key = (k, m.speed.tobytes())
        if key not in self._driven:
            self._driven[key] = site.drum.simulate(k, start, m.speed)
        drum = m.drum_speed - self._driven[key]
        return left, drum / m.noise[NOISES.index("drum_speed")]

    def _simulate(self, k: int, trial: Mapping[str, float]) -> Log:
        """The run's log at these values, at the samples of the thinned recording."""
        log = self.model.simulated(self.runs[k], trial)
        own = self.recordings[k].log.time
        if len(own) == len(log.time):
            return log
        kept = np.searchsorted(log.time, own)
        return Log(own, {name: log[name][kept] for name in log.signals}, log.source)

    def values_at(self, theta: Array) -> Values:
        """See `Fidelity`; what the relations do not hold stays as the fit has it."""
        site, values = self.site, dict(self.where.values)
        for (name, std), t in zip(site.stds.items(), theta, strict=False):
            nominal = self.model.nominal_set.value(name)
            values[name] = float(
                np.clip(nominal + std * t, nominal / START_FACTOR, nominal * START_FACTOR)
            )
        states = [dict(s) for s in self.where.states]
        drum = site.drum_fit
        scales = [min(u.scaled_std, 1.0) for u in drum.unknowns]
        own = theta[len(theta) - len(scales) :]
        for u, mean, scale, t in zip(drum.unknowns, prior_means(drum), scales, own, strict=True):
            scaled = float(np.clip(mean - scale * t, u.scaled(u.lower), u.scaled(u.upper)))
            (values if u.run is None else states[u.run])[u.name] = u.value(scaled)
        return values, states
