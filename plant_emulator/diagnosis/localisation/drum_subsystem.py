"""Gap, shaft and drum alone, driven by the measured motor speed: what the drum's speed should be.

Whatever ails drive, motor, gear friction or torque sensor leaves this simulation untouched; the
drum's speed then tells of gap, shaft, drum and its own sensor only. What the noise of the smoothed
motor speed does to it, the drum's flight through the gap above all, is sampled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.drum_simulation import compiled, drum_speed
from plant_emulator.diagnosis.localisation.parity_relations import NOISES, smoothed_speed
from plant_emulator.estimation.initial_states import GAP
from plant_emulator.estimation.least_squares import estimate, linearise_at
from plant_emulator.estimation.robust_scan import cauchy_loss
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.model.stage import GAP_POSITION

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.localisation.parity_relations import Measured
    from plant_emulator.estimation.unknowns import Estimate, Residual
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

# What of the bench shapes the drum's speed; the drum's inertia only together with the damping.
FREE = ("backlash_half_gap", "drum_shaft_damping")
GAPS = 17
DRAWS = 10
# Mean square in the noise above which the set's own values are tried as a start too.
SUSPECT_MEAN_SQUARE = 1.5
COST_TOLERANCE = 1e-4
# Prior standard deviation of an unknown torque on the drum [10 N m].
TORQUE = 5.0
# Constant torques that a fit starts from [10 N m]; laws of the angle, which are the last ones.
TORQUE_STARTS = (0.0, 1.0, 3.0, 8.0, 20.0)
BY_ANGLE = 2


@dataclass(frozen=True)
class DrumSide:
    """Recordings with their smoothed motor speeds; values : of all parameters [SI].

    laws : of an unknown torque on the drum, shape (n, k) [N m] a run; none: k = 0
    """

    recordings: Sequence[Recording]
    signals: Sequence[Measured]
    parameters: ParameterSet
    values: Mapping[str, float]
    laws: Sequence[Array]

    def simulated(self, run: int, found: Mapping[str, float], speed: Array | None = None) -> Array:
        """The drum's speed [rad/s] with the motor speed as measured, shape (n,).

        found : gap, damping, the gap's position at the start, sizes of the unknown torque, torque_k
        """
        p, inputs = self.values, self.recordings[run].inputs
        sizes = [found.get(f"torque_{k}", 0.0) for k in range(self.laws[run].shape[1])]
        wheel = p["drum_radius"] / p["wheel_radius"] * inputs.wheel_torque
        driven = compiled(drum_speed)(
            inputs.time,
            (self.signals[run].speed if speed is None else speed) / p["gear_ratio"],
            wheel + self.laws[run] @ np.array(sizes),
            inputs.parked,
            found[GAP_POSITION],
            found["backlash_half_gap"],
            p["drum_shaft_stiffness"],
            found["drum_shaft_damping"],
            p["drum_inertia"],
        )
        return np.asarray(driven)

    def residual(self, run: int, found: Mapping[str, float], speed: Array | None = None) -> Array:
        """The drum's speed, measured minus simulated over its noise, shape (n,)."""
        m = self.signals[run]
        left = m.drum_speed - self.simulated(run, found, speed)
        return np.asarray(left / m.noise[NOISES.index("drum_speed")])

    def loss(self, run: int, found: Mapping[str, float]) -> float:
        """Cauchy's loss of a run."""
        return cauchy_loss(self.residual(run, found))

    def scan(self, found: Mapping[str, float]) -> list[float]:
        """Start in the gap of every run, the best of a few."""
        positions = np.linspace(-1.0, 1.0, GAPS)
        losses = [
            [self.loss(k, {**found, GAP_POSITION: float(g)}) for g in positions]
            for k in range(len(self.recordings))
        ]
        return [float(positions[int(np.argmin(own))]) for own in losses]

    def unknowns(self, start: Mapping[str, float], gaps: Sequence[float]) -> list[Unknown]:
        """Gap, damping, sizes of the unknown torque that `start` has, starts of the runs."""
        wide = [
            Unknown(
                name=name,
                start=start[name],
                lower=self.parameters.value(name) / 5.0,
                upper=self.parameters.value(name) * 5.0,
                prior=self.parameters.value(name),
                std=self.parameters[name].std,
            )
            for name in FREE
        ]
        torque = [
            Unknown(name=name, start=size, lower=-1e3, upper=1e3, logarithmic=False, std=TORQUE)
            for name, size in start.items()
            if name.startswith("torque_")
        ]
        return [*wide, *torque, *(replace(GAP, start=g, run=k) for k, g in enumerate(gaps))]

    def fit(self, start: Mapping[str, float], gaps: Sequence[float]) -> Estimate:
        """Least squares from these values."""
        return estimate(self.unknowns(start, gaps), self._functions(), settled=COST_TOLERANCE)

    def at(self, start: Mapping[str, float], gaps: Sequence[float]) -> Estimate:
        """The same, not fitted: residuals and Jacobians there."""
        return linearise_at(self.unknowns(start, gaps), self._functions())

    def _functions(self) -> list[Residual]:
        return [self._function(k) for k in range(len(self.recordings))]

    def _function(self, run: int) -> Residual:
        return lambda found: self.residual(run, found)[None]

    def null(self, start: Mapping[str, float], gaps: Sequence[float]) -> Estimate:
        """The fit without any unknown torque, from a joint fit's end, else from scans of the gap.

        start, gaps : where the joint fit has come to; the set's own values where it lacks them
        """
        own = {name: self.parameters.value(name) for name in FREE}
        near = {name: start.get(name, own[name]) for name in FREE}
        fits = [self.fit(near, gaps)]
        for values in (near, own):
            if fits[-1].cost <= SUSPECT_MEAN_SQUARE * fits[-1].samples:
                break
            fits.append(self.fit(values, self.scan(values)))
        return min(fits, key=lambda f: f.cost + f.penalty)

    def torques(self, size: float) -> dict[str, float]:
        """Sizes of an unknown torque that is the same at all speeds and angles [10 N m]."""
        count = self.laws[0].shape[1]
        return {f"torque_{k}": size if k < count - BY_ANGLE else 0.0 for k in range(count)}

    def far(self, start: Mapping[str, float], gaps: Sequence[float], told: Array) -> Estimate:
        """The fit with an unknown torque that may be far from none, from the best of some sizes.

        told : sizes that something else tells of
        """
        trials = [{**start, **self.torques(size)} for size in TORQUE_STARTS]
        trials.append({**start, **{f"torque_{k}": float(size) for k, size in enumerate(told)}})
        losses = [
            sum(self.loss(k, {**trial, GAP_POSITION: gap}) for k, gap in enumerate(gaps))
            for trial in trials
        ]
        best = trials[int(np.argmin(losses))]
        return self.fit(best, self.scan(best))

    def spread(self, run: int, found: Mapping[str, float], seed: int = 0) -> Array:
        """What noise of the smoothed motor speed does to the residual, shape (n, DRAWS).

        Columns for a covariance: their sum of squares is the variance.
        """
        random, m = np.random.default_rng((seed, run)), self.signals[run]
        base = self.residual(run, found)
        columns = []
        for _ in range(DRAWS):
            w, i, torque = (
                signal + level * random.standard_normal(len(m.time))
                for signal, level in zip(
                    (m.motor_speed, m.current, m.torque), m.noise[[0, 2, 3]], strict=True
                )
            )
            speed = smoothed_speed(
                m.time, w, i, torque, m.noise, self.values, use_current=not m.missing_current
            )
            columns.append(self.residual(run, found, speed) - base)
        return np.asarray(np.stack(columns, axis=-1) / np.sqrt(DRAWS))


def is_torque(fitted: Estimate) -> NDArray[np.bool_]:
    """Which unknowns of a fit are sizes of an unknown torque."""
    return np.array([u.name.startswith("torque_") for u in fitted.unknowns])


def expected(fitted: Estimate) -> Array:
    """Where the unknowns of a fit lie by their priors; those without one stay where they are."""
    pairs = zip(fitted.unknowns, fitted.z, strict=True)
    return np.array([float(z) if u.std is None else u.scaled(u.prior) for u, z in pairs])
