"""A single motor-driven axis as the diagnosis sees it: one channel, the force, told by its motion.

Nothing is integrated: the measured position gives velocity and acceleration, these give the force
that the model says (`axis_effects`), and the residual is the logged force minus that, both in the
band that the model is meant for (`axis_signals`). Linear [m, N] or rotary [rad, N m].

Friction comes and goes with temperature and running in. Where several runs are fitted, each has its
own `friction_level`, by which F_v and F_c of the axis are multiplied: 1 within LEVEL_STD. An axis
that differs from repeat to repeat has drifted, and not another equation. A single run cannot tell
how far runs differ; there the level is 1, in the runs that are predicted too.
"""

from __future__ import annotations

import hashlib
import pickle
from dataclasses import dataclass, replace
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.machine import MeasuredRun
from plant_emulator.diagnosis.machines.axis_candidates import NAMES, UNITS, candidate, scale_of
from plant_emulator.diagnosis.machines.axis_effects import EFFECTS
from plant_emulator.diagnosis.machines.axis_signals import SAMPLES, AxisRun, prepared, told
from plant_emulator.errors import LogError
from plant_emulator.estimation.unknowns import Unknown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.machines.axis_effects import AxisEffect
    from plant_emulator.diagnosis.machines.axis_signals import Motion
    from plant_emulator.estimation.unknowns import Residual
    from plant_emulator.signals.axis_log import AxisLog
    from plant_emulator.signals.log import Array

LEVEL = "friction_level"
LEVEL_STD = 0.1
"""Friction of lubricated machines changes by some per cent a kelvin around room temperature."""
SCREW_PITCH = 0.005
"""[m] a revolution, where none is told; a rotary axis has 2 pi."""
SUBSYSTEMS = dict(zip(NAMES, ("drum", "gear", "gear", "torque_sensor"), strict=True))


class AxisModel:
    """An axis and its logs; see `Model`.

    effects : the library's, by name
    fitted : runs that are fitted: their least squares are the nominal parameters; None: all
    pitch : travel of a revolution [m or rad]; None: SCREW_PITCH, or 2 pi of a rotary axis
    rate : samples a second that remain [Hz]; None: as many as the force tells something in
    """

    subsystems = SUBSYSTEMS
    reaches_noise = False

    def __init__(
        self,
        logs: Sequence[AxisLog],
        effects: Mapping[str, AxisEffect] = EFFECTS,
        *,
        fitted: Sequence[int] | None = None,
        pitch: float | None = None,
        rate: float | None = None,
    ) -> None:
        rotary = one_kind(logs)
        rate = rate or SAMPLES * max(told(log) for log in logs)
        self._runs = [prepared(log, rate) for log in logs]
        self.scale = scale_of(self._runs, pitch or (2.0 * pi if rotary else SCREW_PITCH))
        self._effects = effects
        self.candidates = {
            name: candidate(name, effect, self.scale, rotary=rotary)
            for name, effect in effects.items()
        }
        self.units = UNITS[rotary]
        fitted = range(len(logs)) if fitted is None else fitted
        self.parameters = self._parameters(fitted)
        self.states = (
            (Unknown(name=LEVEL, start=1.0, lower=0.3, upper=3.0, prior=1.0, std=LEVEL_STD),)
            if len(fitted) > 1
            else ()
        )
        self.runs = [
            MeasuredRun(
                source=r.source,
                channels=("torque" if rotary else "force",),
                units=(self.units["offset"],),
                time=r.time,
                measured=r.force[None, :],
                noise=np.array([r.noise]),
            )
            for r in self._runs
        ]

    def residual(self, run: int, effects: Sequence[str]) -> Residual:
        """See `Model`."""
        there = self._runs[run]
        laws = [effect.law for name, effect in self._effects.items() if name in effects]

        def residual(found: Mapping[str, float]) -> Array:
            level = found.get(LEVEL, 1.0)
            p = {**found, **{name: level * found[name] for name in NAMES[1:3]}}
            force = nominal(there.motion, p)
            for law in laws:
                force = law(force, there.motion, p, self.scale)
            difference = (there.force - there.band(force)) / there.noise
            return np.where(there.moves, difference, 0.0)[None, :]

        return residual

    def input_noise(self, run: int, where: FitResult, state: Mapping[str, float]) -> None:  # noqa: ARG002 - `Model`'s signature
        """See `Model`: the motion is fed, but smoothed."""
        return

    def nominal(self, runs: Sequence[int]) -> dict[str, float]:
        """See `Model`: an axis has no data sheet; least squares of these runs."""
        return self._least_squares(runs, self.parameters)

    def start_values(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        """See `Model`: least squares, for which the axis without effects is linear."""
        return self.nominal(runs), [self._level() for _ in runs]

    def initial_states(
        self,
        run: int,  # noqa: ARG002 - `Model`'s signature
        effects: Sequence[str],  # noqa: ARG002 - `Model`'s signature
        values: Mapping[str, float],  # noqa: ARG002 - `Model`'s signature
    ) -> dict[str, float]:
        """See `Model`."""
        return self._level()

    def locate(self, where: FitResult, runs: Sequence[int]) -> None:  # noqa: ARG002 - `Model`'s signature
        """See `Model`: one channel has no blocks to tell apart."""
        return

    def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> AxisModel:  # noqa: ARG002 - `Model`'s signature
        """See `Model`: an axis has no drive programs."""
        return self

    def missing_experiments(self, runs: Sequence[int]) -> dict[str, tuple[str, ...]]:  # noqa: ARG002 - `Model`'s signature
        """See `Model`: what an effect needs is told with the effect."""
        return {}

    def _level(self) -> dict[str, float]:
        return {u.name: u.start for u in self.states}

    def _least_squares(self, runs: Sequence[int], unknowns: Sequence[Unknown]) -> dict[str, float]:
        from scipy.optimize import lsq_linear

        own = [self._runs[k] for k in runs]
        rows = np.concatenate([regressor(r)[r.moves] / r.noise for r in own])
        wanted = np.concatenate([r.force[r.moves] / r.noise for r in own])
        sizes = np.array([u.scale for u in unknowns])
        lower = [u.scaled(u.lower) for u in unknowns]
        upper = [u.scaled(u.upper) for u in unknowns]
        found = sizes * lsq_linear(rows * sizes, wanted, (lower, upper)).x
        return dict(zip(NAMES, map(float, found), strict=True))

    def _parameters(self, fitted: Sequence[int]) -> tuple[Unknown, ...]:
        """The nominal parameters, each of a scale at which it makes all of the force."""
        columns = np.concatenate([regressor(r) for r in self._runs])
        sizes = self.scale.force / np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300)
        unknowns = [
            Unknown(
                name=name,
                start=0.0,
                lower=-10.0 * size if name == "offset" else 0.0,
                upper=10.0 * size,
                logarithmic=False,
                scale=size,
            )
            for name, size in zip(NAMES, map(float, sizes), strict=True)
        ]
        found = self._least_squares(fitted, unknowns)
        return tuple(replace(u, start=found[u.name], prior=found[u.name]) for u in unknowns)


def nominal(m: Motion, p: Mapping[str, float]) -> Array:
    """Force without effects [N or N m]: M q'' + F_v q' + F_c sgn q' + F_0."""
    friction = p["viscous_friction"] * m.velocity + p["coulomb_friction"] * m.direction
    return np.asarray(p["inertia"] * m.acceleration + friction + p["offset"])


def regressor(run: AxisRun) -> Array:
    """Derivative of the force by each nominal parameter, shape (samples, 4)."""
    m = run.motion
    columns = (m.acceleration, m.velocity, m.direction, np.ones(len(m.velocity)))
    return np.stack([run.band(column) for column in columns], axis=1)


def one_kind(logs: Sequence[AxisLog]) -> bool:
    """Whether the logs are of a rotary axis; LogError where they are of both kinds."""
    for log in logs[1:]:
        if log.rotary != logs[0].rotary:
            kinds = {False: "linear (m, N)", True: "rotary (rad, N m)"}
            raise LogError(
                f"{log.source}: {kinds[log.rotary]}, while {logs[0].source} is "
                f"{kinds[logs[0].rotary]}; logs of one axis are needed"
            )
    return logs[0].rotary


@dataclass(frozen=True)
class AxisRecipe:
    """What builds an `AxisModel` on another process; without : effects taken out of the library."""

    logs: tuple[AxisLog, ...]
    fitted: tuple[int, ...] | None = None
    without: tuple[str, ...] = ()
    pitch: float | None = None

    def build(self) -> AxisModel:
        """The model."""
        library = {name: e for name, e in EFFECTS.items() if name not in self.without}
        return AxisModel(self.logs, library, fitted=self.fitted, pitch=self.pitch)

    def digest(self) -> str:
        """Hash of all that the model is made of."""
        return hashlib.sha256(pickle.dumps(self)).hexdigest()
