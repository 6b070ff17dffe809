"""The roller bench as a machine that can be diagnosed."""

from __future__ import annotations

import hashlib
import pickle
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.locate import locate
from plant_emulator.diagnosis.machine import Course, MeasuredRun
from plant_emulator.diagnosis.machines.bench_candidates import (
    SUBSYSTEM_OF,
    candidate,
    hidden_effects,
)
from plant_emulator.diagnosis.machines.bench_programs import (
    COLD_SHELL,
    missing_experiments,
    planned_runs,
)
from plant_emulator.diagnosis.machines.bench_relations import BenchRelations
from plant_emulator.diagnosis.wording import UNITS as SIGNAL_UNITS
from plant_emulator.effects import from_file
from plant_emulator.errors import UnsettledError
from plant_emulator.estimation.equation_error import start_values
from plant_emulator.estimation.free_parameters import free_parameters, unknowns
from plant_emulator.estimation.initial_states import (
    scan_states,
    states_of,
    with_logged_values,
)
from plant_emulator.estimation.nearby import Beside
from plant_emulator.estimation.residuals import run_residual
from plant_emulator.estimation.start_search import StartSearch
from plant_emulator.model.array_laws import base_speed
from plant_emulator.model.parameters import UNITS
from plant_emulator.model.stage import GAP_POSITION, split_gap_position
from plant_emulator.recordings.input_noise import noise_directions
from plant_emulator.signals.log import VOLTAGE
from plant_emulator.simulation.simulate import FIT_TOLERANCE, simulate, values_of
from plant_emulator.solver.kernel import kernel, use_own_effects

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from plant_emulator.diagnosis.answer import Location
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machine import Candidate
    from plant_emulator.effects import Effect
    from plant_emulator.estimation.noise.channel_noise import Whitener
    from plant_emulator.estimation.unknowns import Residual
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.input_noise import NoiseDirections
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Log
    from plant_emulator.simulation.simulate import MeasuredSpeeds

# Tolerance of a run with a truck or of one that is led. It takes half the time of the others or
# less, because every sample of the one is a corner and every correction of the other is a jump. It
# changes the residual by some hundredths of the noise.
COARSE_TOLERANCE = 2e-3
# Largest step [s], over some samples. It takes a third of the time off smooth runs. That of
# `simulate` is shorter, because step control does not watch the memories of effects; with those of
# the library a run is as exact in these steps.
LONGEST_STEP = 0.03


class BenchModel:
    """The bench with its logs; see `Model`.

    Effects of the parameter set belong to the bench. Their sizes stay as they are; what each run
    has of its own is a state of every fit. The gap of such a bench is not located, because the
    parity relations know the nominal equations only.
    """

    def __init__(
        self,
        recordings: Sequence[Recording],
        parameters: ParameterSet,
        effects: Mapping[str, Effect],
        free: Sequence[str] = (),
    ) -> None:
        voltage = [VOLTAGE in r.channels for r in recordings]
        unknown = [r.estimated_torque for r in recordings]
        self._free = free_parameters(parameters, free, recordings)
        self._effects = effects
        self._values = values_of(parameters)
        self.nominal_set = parameters
        self._along: list[MeasuredSpeeds] | None = None
        known = {**kernel().effects, **effects}
        plausible = {name: effect.plausible() for name, effect in effects.items()}
        everything = {**plausible, **parameters.effects}
        self._recordings = [with_logged_values(r, everything, known) for r in recordings]
        self._given = {f"{e}_{key}" for e, own in parameters.effects.items() for key in own}
        self.states = states_of(parameters.effects, known)
        hides = [hidden_effects(effects, r) for r in recordings]
        hidden = frozenset.intersection(*hides) if any(unknown) else frozenset()
        self.candidates: Mapping[str, Candidate] = {
            name: candidate(effect, voltage=all(voltage), unknown_torque=name in hidden)
            for name, effect in effects.items()
        }
        self.parameters = tuple(unknowns(parameters, self._free, self._values, ()))
        self.units = {name: UNITS[name] for name in self._free}
        self.subsystems = {name: SUBSYSTEM_OF.get(name, "drive") for name in self._free}
        self.runs = [
            MeasuredRun(
                source=r.log.source,
                channels=r.channels,
                units=tuple(SIGNAL_UNITS[name] for name in r.channels),
                time=r.log.time,
                measured=np.stack([r.log[name] for name in r.channels]),
                noise=r.noise,
                noise_ratio=r.noise_ratio,
                uncertain_inputs=r.uncertain_inputs,
                hides=own,
            )
            for r, own in zip(recordings, hides, strict=True)
        ]

    def recording(self, run: int) -> Recording:
        """The recording of a run."""
        return self._recordings[run]

    def fixed_values(self, run: int, effects: Sequence[str]) -> dict[str, float]:
        """Values that no fit of these effects changes: of set, effects and log."""
        fixed = {k: v for name in effects for k, v in self.candidates[name].fixed.items()}
        logged = self._recordings[run].logged_values
        own = {k: v for k, v in logged.items() if k in fixed or k in self._given}
        return {**self._values, **fixed, **own}

    def residual(self, run: int, effects: Sequence[str]) -> Residual:
        """See `Model`."""
        fixed, (tolerance, along) = self.fixed_values(run, effects), self._course_of(run)
        return run_residual(self._recordings[run], fixed, tolerance, LONGEST_STEP, along)

    unwhitened_residual = residual

    def _course_of(self, run: int) -> tuple[float, MeasuredSpeeds | None]:
        """Tolerance of a run, and the speeds that it is led along."""
        along = None if self._along is None else self._along[run]
        coarse = self._recordings[run].inputs.truck or along is not None
        return COARSE_TOLERANCE if coarse else FIT_TOLERANCE, along

    def observer(self, interval: float) -> BenchModel:
        """See `Model`: led along the measured speeds."""
        found = copy(self)
        along = [r.measured_speeds(interval) for r in self._recordings]
        vars(found).update(_along=along)
        return found

    def simulated(self, run: int, values: Mapping[str, float]) -> Log:
        """The log that a run would have given at these values of everything."""
        tolerance, along = self._course_of(run)
        own, gap = split_gap_position(values)
        return simulate(
            self._recordings[run].inputs,
            own,
            gap_position=gap,
            tolerance=tolerance,
            largest_step=LONGEST_STEP,
            along=along,
        )

    def relations(
        self,
        where: FitResult,
        runs: Sequence[int],
        whiteners: Mapping[int, Sequence[Whitener]] | None = None,
    ) -> BenchRelations | None:
        """See `Model`; None with effects of the set, and where the fit cannot be simulated."""
        with suppress(UnsettledError):
            return None if self._given else BenchRelations(self, where, runs, whiteners)
        return None

    def input_noise(
        self, run: int, where: FitResult, state: Mapping[str, float]
    ) -> NoiseDirections | None:
        """See `Model`."""
        values = {**self.fixed_values(run, where.effects), **where.values, **state}
        return noise_directions(self._recordings[run], *split_gap_position(values))

    def course(
        self, run: int, effects: Sequence[str], values: Mapping[str, float]
    ) -> Course | None:
        """See `Model`: the gear's output turns, as far as the shown motor speed takes it."""
        every = {**self.fixed_values(run, effects), **values}
        with suppress(UnsettledError):
            log = self.simulated(run, every)
            speed = log["motor_speed"] / (every["gear_ratio"] * 2.0 * np.pi)
            turns = np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(log.time)))
            return Course(channels=np.stack([log[c] for c in self.runs[run].channels]), turns=turns)
        return None

    def nominal(self, runs: Sequence[int]) -> dict[str, float]:  # noqa: ARG002 - `Model`'s signature
        """See `Model`: the values of the parameter set."""
        return {u.name: u.prior for u in self.parameters}

    def start_values(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        """See `Model`."""
        recordings = [self._recordings[k] for k in runs]
        search = StartSearch(recordings, self._values, self._free)
        search.values |= start_values([r.log for r in recordings], self.nominal_set, self._free)
        search.scan()
        found = {name: search.values[name] for name in self._free}
        if self._given:
            return found, [self.initial_states(k, (), found) for k in runs]
        return found, [{GAP_POSITION: gap} for gap in search.gaps]

    def initial_states(
        self, run: int, effects: Sequence[str], values: Mapping[str, float]
    ) -> dict[str, float]:
        """See `Model`."""
        given = [u for u in self.states if u.name != GAP_POSITION]
        groups = [given, *(self.candidates[name].states for name in effects)]
        residual, plain = self.residual(run, effects), None
        if any(u.angle for group in groups for u in group):
            own = {name: value for name, value in values.items() if name in self._free}
            plain = {**self.fixed_values(run, ()), **own}
        return scan_states(
            self._recordings[run],
            {**self.fixed_values(run, effects), **values},
            groups,
            Beside(residual, values),
            plain,
        )

    def locate(self, where: FitResult, runs: Sequence[int]) -> Location | None:
        """See `Model`."""
        if self._given:
            return None
        return locate([self._recordings[k] for k in runs], self.nominal_set, where)

    def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> BenchModel:
        """See `Model`: drive programs that no log shows; they start as the last run did."""
        warm = {**self.fixed_values(runs[-1], where.effects), **where.values, **where.states[-1]}
        fitted = self.nominal_set.with_values({name: where.values[name] for name in self._free})
        more = planned_runs(self._recordings, fitted, warm, {**warm, **self._cold(where.effects)})
        return BenchModel([*self._recordings, *more], self.nominal_set, self._effects, self._free)

    def missing_experiments(self, runs: Sequence[int]) -> dict[str, tuple[str, ...]]:
        """See `Model`."""
        return missing_experiments(
            [self._recordings[k].log for k in runs], base_speed(self._values)
        )

    def _cold(self, effects: Sequence[str]) -> dict[str, float]:
        """Values of these effects' states that differ where the gear starts cold."""
        tables = {name: self._effects[name].parameters for name in effects}
        return {
            f"{name}_{key}": COLD_SHELL
            for name, own in tables.items()
            for key, p in own.items()
            if p.per_run and p.unit == "K" and any(q.measured for q in own.values())
        }


@dataclass(frozen=True)
class BenchRecipe:
    """The recipe of a `BenchModel`.

    without : effects to take out of the library
    own : paths of the files of a user's own effects
    free : parameters to fit; empty: those that the recordings show
    """

    recordings: tuple[Recording, ...]
    parameters: ParameterSet
    without: tuple[str, ...] = ()
    own: tuple[Path, ...] = ()
    free: tuple[str, ...] = ()

    def known_effects(self) -> dict[str, Effect]:
        """Effects to test, by name: those that this process knows and the bench has not."""
        left_out = {*self.without, *self.parameters.effects}
        return {n: effect for n, effect in kernel().effects.items() if n not in left_out}

    def build(self) -> BenchModel:
        """Build the model; this process then knows the user's own effects."""
        use_own_effects(*(from_file(path) for path in self.own))
        return BenchModel(self.recordings, self.parameters, self.known_effects(), self.free)

    def digest(self) -> str:
        """Hash of all that the model is made of.

        It contains the text of a user's own effects, because a worker outlives an edit of a file.
        """
        texts = [path.read_bytes() for path in self.own]
        return hashlib.sha256(pickle.dumps((self, texts))).hexdigest()
