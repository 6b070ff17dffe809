"""A single motor-driven axis as a machine that can be diagnosed: its motion explains its force.

The axis is linear [m, N] or rotary [rad, N m] and has one channel, the force. Nothing is
integrated. The measured position gives velocity and acceleration; these give the force of the model
(`axis_effects`). The residual is the logged force minus that force, both in the band that the model
is meant for (`axis_signals`).

Friction changes with temperature and running in. Where several runs are fitted, each has its own
`friction_level`, which multiplies the axis's F_v and F_c and is 1 within LEVEL_STD. An axis that
differs from run to run has thus changed, and does not follow another equation. A single run cannot
tell how far runs differ: its level is 1, and so is that of the runs that are predicted.
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
from plant_emulator.diagnosis.machines.axis_signals import (
    SAMPLES_PER_HERTZ,
    AxisRun,
    informative_frequency,
    prepare,
)
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
# Prior standard deviation of the friction level. The friction of lubricated machines changes by
# some per cent a kelvin around room temperature.
LEVEL_STD = 0.1
# Travel of a revolution where none is given [m]; a rotary axis has 2 pi.
SCREW_PITCH = 0.005
SUBSYSTEMS = dict(zip(NAMES, ("drum", "gear", "gear", "torque_sensor"), strict=True))


class AxisModel:
    """An axis with its logs; see `Model`.

    effects : the library, by name
    fitted : runs whose least squares give the nominal parameters; None: all
    pitch : travel of a revolution [m or rad]; None: SCREW_PITCH, or 2 pi for a rotary axis
    rate : sample rate of the compared force [Hz]; None: that of the band in which the force is
        informative
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
        rotary = is_rotary(logs)
        rate = rate or SAMPLES_PER_HERTZ * max(informative_frequency(log) for log in logs)
        self._runs = [prepare(log, rate) for log in logs]
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
        measured = self._runs[run]
        laws = [effect.law for name, effect in self._effects.items() if name in effects]

        def residual(found: Mapping[str, float]) -> Array:
            level = found.get(LEVEL, 1.0)
            p = {**found, **{name: level * found[name] for name in NAMES[1:3]}}
            force = nominal_force(measured.motion, p)
            for law in laws:
                force = law(force, measured.motion, p, self.scale)
            difference = (measured.force - measured.band(force)) / measured.noise
            return np.where(measured.moves, difference, 0.0)[None, :]

        return residual

    unwhitened_residual = residual

    def relations(self, where: FitResult, runs: Sequence[int], whiteners: object = None) -> None:
        """See `Model`: the residual is that of the axis' only relation."""

    def input_noise(self, run: int, where: FitResult, state: Mapping[str, float]) -> None:  # noqa: ARG002 - `Model`'s signature
        """See `Model`: the motion is a measured input, but a smoothed one."""
        return

    def nominal(self, runs: Sequence[int]) -> dict[str, float]:
        """See `Model`: an axis has no data sheet, so least squares of these runs."""
        return self._least_squares(runs, self.parameters)

    def start_values(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        """See `Model`: least squares, because the axis without effects is linear."""
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
        """See `Model`: one channel has no blocks that could be told apart."""
        return

    def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> AxisModel:  # noqa: ARG002 - `Model`'s signature
        """See `Model`: an axis has no drive programs."""
        return self

    def missing_experiments(self, runs: Sequence[int]) -> dict[str, tuple[str, ...]]:  # noqa: ARG002 - `Model`'s signature
        """See `Model`: each effect says itself what it needs."""
        return {}

    def _level(self) -> dict[str, float]:
        return {u.name: u.start for u in self.states}

    def _least_squares(self, runs: Sequence[int], unknowns: Sequence[Unknown]) -> dict[str, float]:
        from scipy.optimize import lsq_linear

        own = [self._runs[k] for k in runs]
        rows = np.concatenate([regressors(r)[r.moves] / r.noise for r in own])
        wanted = np.concatenate([r.force[r.moves] / r.noise for r in own])
        sizes = np.array([u.scale for u in unknowns])
        lower = [u.scaled(u.lower) for u in unknowns]
        upper = [u.scaled(u.upper) for u in unknowns]
        found = sizes * lsq_linear(rows * sizes, wanted, (lower, upper)).x
        return dict(zip(NAMES, map(float, found), strict=True))

    def _parameters(self, fitted: Sequence[int]) -> tuple[Unknown, ...]:
        """The nominal parameters, each with the scale at which it makes all of the force."""
        columns = np.concatenate([regressors(r) for r in self._runs])
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


def nominal_force(m: Motion, p: Mapping[str, float]) -> Array:
    """Force without effects [N or N m].

    F = M q'' + F_v q' + F_c sgn q' + F_0
    """
    friction = p["viscous_friction"] * m.velocity + p["coulomb_friction"] * m.direction
    return np.asarray(p["inertia"] * m.acceleration + friction + p["offset"])


def regressors(run: AxisRun) -> Array:
    """Derivatives of the force by the nominal parameters, in the band, shape (samples, 4)."""
    m = run.motion
    columns = (m.acceleration, m.velocity, m.direction, np.ones(len(m.velocity)))
    return np.stack([run.band(column) for column in columns], axis=1)


def is_rotary(logs: Sequence[AxisLog]) -> bool:
    """Whether the logs are of a rotary axis; raises LogError where they are of both kinds."""
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
    """The recipe of an `AxisModel`; without : effects to take out of the library."""

    logs: tuple[AxisLog, ...]
    fitted: tuple[int, ...] | None = None
    without: tuple[str, ...] = ()
    pitch: float | None = None

    def build(self) -> AxisModel:
        """Build the model."""
        library = {name: e for name, e in EFFECTS.items() if name not in self.without}
        return AxisModel(self.logs, library, fitted=self.fitted, pitch=self.pitch)

    def digest(self) -> str:
        """Hash of all that the model is made of."""
        return hashlib.sha256(pickle.dumps(self)).hexdigest()
