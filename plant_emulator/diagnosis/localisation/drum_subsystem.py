"""The drum subsystem: gap, shaft and drum, simulated with the measured motor speed as input.

A fault of drive, motor, gear friction or torque sensor leaves this simulation untouched. The drum
speed then tells of gap, shaft, drum and its own sensor only. The noise of the smoothed motor speed
disturbs the simulation, above all the drum's flight through the gap; the disturbance is sampled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.drum_simulation import compile_once, drum_speed
from plant_emulator.diagnosis.localisation.measured_signals import NOISES, smoothed_speed
from plant_emulator.estimation.initial_states import GAP
from plant_emulator.estimation.least_squares import SUSPECT_MEAN_SQUARE, estimate, linearise_at
from plant_emulator.estimation.robust_scan import cauchy_loss
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.model.stage import GAP_POSITION

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.localisation.measured_signals import MeasuredSignals
    from plant_emulator.estimation.unknowns import Estimate, Residual
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

# Free parameters. The drum's inertia shapes the drum speed only together with the damping.
FREE = ("backlash_half_gap", "drum_shaft_damping")
# Positions in the gap that a scan tries, and draws of the speed's noise.
SCANNED_POSITIONS = 17
NOISE_DRAWS = 10
# Relative fall of the cost that ends a fit.
DRUM_COST_TOLERANCE = 1e-4
# Prior standard deviation of the sizes of an unknown torque on the drum [10 N m].
TORQUE_STD = 5.0
# Constant torques that a fit starts from [10 N m].
TORQUE_STARTS = (0.0, 1.0, 3.0, 8.0, 20.0)
# The last laws of the unknown torque are laws of the angle.
LAWS_OF_ANGLE = 2


@dataclass(frozen=True)
class DrumSubsystem:
    """The drum subsystem in all runs.

    values : of all parameters [SI]
    laws : basis of an unknown torque on the drum [N m], shape (n, k), one array a run
    """

    recordings: Sequence[Recording]
    signals: Sequence[MeasuredSignals]
    parameters: ParameterSet
    values: Mapping[str, float]
    laws: Sequence[Array]

    def simulate(self, run: int, found: Mapping[str, float], speed: Array | None = None) -> Array:
        """Simulate the drum speed [rad/s] of a run, shape (n,).

        found : gap, damping, position in the gap at the start, and sizes torque_k of the torque
        speed : motor speed [rad/s]; None: the smoothed measurement
        """
        p, inputs = self.values, self.recordings[run].inputs
        sizes = [found.get(f"torque_{k}", 0.0) for k in range(self.laws[run].shape[1])]
        wheel = p["drum_radius"] / p["wheel_radius"] * inputs.wheel_torque
        driven = compile_once(drum_speed)(
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
        if inputs.sensing is None:
            return np.asarray(driven)
        fine = np.interp(inputs.sensing.time, inputs.time, driven)
        return inputs.sensing.show("drum_speed", fine)

    def residual(self, run: int, found: Mapping[str, float], speed: Array | None = None) -> Array:
        """Drum speed, measured minus simulated over its noise [1], shape (n,)."""
        m = self.signals[run]
        left = m.drum_speed - self.simulate(run, found, speed)
        return np.asarray(left / m.noise[NOISES.index("drum_speed")])

    def loss(self, run: int, found: Mapping[str, float]) -> float:
        """Cauchy's loss of a run [1]."""
        return cauchy_loss(self.residual(run, found))

    def scan(self, found: Mapping[str, float]) -> list[float]:
        """Find the best of some positions in the gap at the start [1], for every run."""
        positions = np.linspace(-1.0, 1.0, SCANNED_POSITIONS)
        losses = [
            [self.loss(k, {**found, GAP_POSITION: float(g)}) for g in positions]
            for k in range(len(self.recordings))
        ]
        return [float(positions[int(np.argmin(own))]) for own in losses]

    def unknowns(self, start: Mapping[str, float], gaps: Sequence[float]) -> list[Unknown]:
        """List gap, damping, the sizes of the torque in `start`, and the positions in the gap."""
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
            Unknown(name=name, start=size, lower=-1e3, upper=1e3, logarithmic=False, std=TORQUE_STD)
            for name, size in start.items()
            if name.startswith("torque_")
        ]
        return [*wide, *torque, *(replace(GAP, start=g, run=k) for k, g in enumerate(gaps))]

    def fit(self, start: Mapping[str, float], gaps: Sequence[float]) -> Estimate:
        """Fit by least squares from these values and positions in the gap."""
        return estimate(self.unknowns(start, gaps), self._functions(), settled=DRUM_COST_TOLERANCE)

    def linearise(self, start: Mapping[str, float], gaps: Sequence[float]) -> Estimate:
        """Compute residuals and Jacobians at these values, without fitting."""
        return linearise_at(self.unknowns(start, gaps), self._functions())

    def _functions(self) -> list[Residual]:
        return [self._function(k) for k in range(len(self.recordings))]

    def _function(self, run: int) -> Residual:
        return lambda found: self.residual(run, found)[None]

    def fit_null(self, start: Mapping[str, float], gaps: Sequence[float]) -> Estimate:
        """Fit without an unknown torque, from a joint fit or else from scans of the gap.

        start, gaps : values and positions of the joint fit; the set gives those that it lacks
        """
        own = {name: self.parameters.value(name) for name in FREE}
        near = {name: start.get(name, own[name]) for name in FREE}
        fits = [self.fit(near, gaps)]
        for values in (near, own):
            if fits[-1].cost <= SUSPECT_MEAN_SQUARE * fits[-1].samples:
                break
            fits.append(self.fit(values, self.scan(values)))
        return min(fits, key=lambda f: f.cost + f.penalty)

    def torque_sizes(self, size: float) -> dict[str, float]:
        """Sizes of an unknown torque that is constant in speed and angle, by name [10 N m]."""
        count = self.laws[0].shape[1]
        return {f"torque_{k}": size if k < count - LAWS_OF_ANGLE else 0.0 for k in range(count)}

    def fit_torque(
        self, start: Mapping[str, float], gaps: Sequence[float], sizes: Array
    ) -> Estimate:
        """Fit with an unknown torque that may be large, from the best of some sizes.

        sizes : further sizes to start from [10 N m]
        """
        trials = [{**start, **self.torque_sizes(size)} for size in TORQUE_STARTS]
        trials.append({**start, **{f"torque_{k}": float(size) for k, size in enumerate(sizes)}})
        losses = [
            sum(self.loss(k, {**trial, GAP_POSITION: gap}) for k, gap in enumerate(gaps))
            for trial in trials
        ]
        best = trials[int(np.argmin(losses))]
        return self.fit(best, self.scan(best))

    def speed_noise(self, run: int, found: Mapping[str, float], seed: int = 0) -> Array:
        """Sample the noise of the smoothed motor speed in the residual [1], shape (n, NOISE_DRAWS).

        The sum of squares of a row is the variance of its sample.
        """
        random, m = np.random.default_rng((seed, run)), self.signals[run]
        base = self.residual(run, found)
        columns = []
        for _ in range(NOISE_DRAWS):
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
        return np.asarray(np.stack(columns, axis=-1) / np.sqrt(NOISE_DRAWS))


def is_torque_size(fitted: Estimate) -> NDArray[np.bool_]:
    """Whether each unknown of a fit is a size of the unknown torque."""
    return np.array([u.name.startswith("torque_") for u in fitted.unknowns])


def prior_means(fitted: Estimate) -> Array:
    """Prior means of the unknowns of a fit, on its scale; an unknown without a prior stays."""
    pairs = zip(fitted.unknowns, fitted.z, strict=True)
    return np.array([float(z) if u.std is None else u.scaled(u.prior) for u, z in pairs])
