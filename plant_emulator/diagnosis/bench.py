"""The bench as the diagnosis sees it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.model import Candidate, Run
from plant_emulator.equation_error import start_values
from plant_emulator.estimation import Unknown
from plant_emulator.identify import free_parameters, unknowns
from plant_emulator.search import GAP_POSITION, Search
from plant_emulator.simulate import values_of
from plant_emulator.start_states import GAP, with_own

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.effects import Effect
    from plant_emulator.estimation import Array, Residual
    from plant_emulator.parameters import ParameterSet
    from plant_emulator.recording import Recording


def candidate(effect: Effect) -> Candidate:
    """An effect's declaration as unknowns of a fit."""
    sizes: list[Unknown] = []
    shapes: list[Unknown] = []
    states: list[Unknown] = []
    for key, declared in effect.parameters.items():
        unknown = Unknown(
            name=f"{effect.name}_{key}",
            start=declared.plausible,
            lower=declared.lower,
            upper=declared.upper,
            logarithmic=False,
            scale=declared.std or abs(declared.plausible - declared.neutral) or 1.0,
            prior=declared.plausible,
            std=declared.std,
        )
        if declared.std is not None:
            (states if declared.per_run else shapes).append(unknown)
        elif declared.plausible != declared.neutral and not declared.per_run:
            sizes.append(unknown)
    free = {u.name for u in (*sizes, *shapes, *states)}
    neutral = {f"{effect.name}_{k}": d.neutral for k, d in effect.parameters.items()}
    plausible = {f"{effect.name}_{k}": d.plausible for k, d in effect.parameters.items()}
    return Candidate(
        name=effect.name,
        subsystem=effect.subsystem,
        sizes=tuple(sizes),
        shapes=tuple(shapes),
        states=tuple(states),
        neutral={u.name: neutral[u.name] for u in sizes},
        fixed={name: value for name, value in plausible.items() if name not in free},
    )


class BenchModel:
    """The bench and its logs; see `Model`."""

    states = (GAP,)

    def __init__(
        self,
        recordings: Sequence[Recording],
        parameters: ParameterSet,
        effects: Mapping[str, Effect],
        free: Sequence[str] = (),
    ) -> None:
        self._free = free_parameters(parameters, free)
        self._values = values_of(parameters)
        self._set = parameters
        everything = {name: effect.plausible() for name, effect in effects.items()}
        self._recordings = [with_own(r, everything, effects) for r in recordings]
        self.candidates = {name: candidate(effect) for name, effect in effects.items()}
        self.parameters = tuple(unknowns(parameters, self._free, self._values, ()))
        self.runs = [
            Run(source=r.log.source, channels=r.channels, time=r.log.time, noise=r.noise)
            for r in recordings
        ]

    def residual(self, run: int, effects: Sequence[str]) -> Residual:
        """See `Model`."""
        recording = self._recordings[run]
        there = {k: v for name in effects for k, v in self.candidates[name].fixed.items()}
        own = {k: v for k, v in recording.own.items() if k in there}
        fixed = {**self._values, **there, **own}

        def residual(found: Mapping[str, float]) -> Array:
            trial = {**fixed, **found}
            return recording.residual(trial, trial.pop(GAP_POSITION))

        return residual

    def search(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        """See `Model`."""
        recordings = [self._recordings[k] for k in runs]
        search = Search(recordings, self._values, self._free)
        search.values |= start_values([r.log for r in recordings], self._values, self._free)
        search.scan()
        return (
            {name: search.values[name] for name in self._free},
            [{GAP_POSITION: gap} for gap in search.gaps],
        )
