"""Road load from coast-downs: runs in which a truck rolls out by itself (pure).

Most owners have no load cell at the motor. A truck that rolls obeys

    m_e dv/dt = -(F0 + F1 v) - s G,    m_e = m + 0.03 (m + 25 kg)

with the speed v over ground, the direction s = +1 or -1, and the force G of a grade or a wind along
the road. The rotating mass is that of EU 2017/1151, sub-annex 4, where it was not measured. Once
integrated, the law is linear in what is unknown:

    v(t) = v_0 - (F0 t + F1 x(t) + s G t) / m_e,    x(t) = integral v dt

so that least squares give F0, F1, G and the speed v_0 of each run. Runs in both directions tell G
from F0. Noise of the speed stays on the left, because the integral of it is small. The standard
errors count for residuals that follow each other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.road_load.answer import TruckEstimate
from plant_emulator.simulation.truck import GRAVITY

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.signals.log import Array

ROTATING, DRIVER = 0.03, 25.0
"""Share of rotating mass, and the mass [kg] that counts with the truck for it."""
LOWEST_SPEED = 0.3
"""[m/s] Speed at which a run ends: below it, a truck stops by its brake or its stiction."""
BEGUN = 0.2
"""[m/s] Fall of the speed that shows that the truck rolls out: what it drove before is over."""
LEAST_FALL = 1.0
"""[m/s] Least change of the speed of a run."""
SMOOTHING = 0.5
"""[s] Time over which the speed is smoothed to find where the truck begins to roll out."""
LONGEST_SAMPLE_STEP = 0.1
"""[s] Longest time between samples: 10 Hz."""
PRECISION = 0.03
"""Relative error of the mean force that is usual at most (from memory, for comparison)."""


@dataclass(frozen=True, kw_only=True)
class RollOut:
    """One roll-out in SI, shape (n,) each; speed over ground, direction +1 or -1."""

    name: str
    time: Array
    speed: Array
    direction: int


@dataclass(frozen=True, kw_only=True)
class CoastDown:
    """Road load of a truck from its coast-downs.

    mass : with load [kg]; grade : force of grade and wind in the first direction [N]
    force_error : standard error of the force at mean speed, relative
    """

    mass: float
    f0: TruckEstimate
    f1: TruckEstimate
    grade: TruckEstimate
    force_error: float
    forward: int
    backward: int

    def to_json(self, drum_radius: float) -> dict[str, Any]:
        """The answer as JSON types, schema truck/1; crr_v refers to a drum of this radius [m]."""
        weight = self.mass * GRAVITY
        return {
            "schema": "truck/1",
            "method": "coast-down",
            "crr": _scale(self.f0, 1.0 / weight),
            "crr_v": _scale(self.f1, drum_radius / weight),
            "efficiency": None,
            "f0_newton": _scale(self.f0, 1.0),
            "f1_newton_per_m_s": _scale(self.f1, 1.0),
            "grade_newton": _scale(self.grade, 1.0),
            "force_error": self.force_error,
            "runs": {"forward": self.forward, "backward": self.backward},
            "not_separable": [
                "mass from f0 and f1: they are proportional to the given mass",
                "f2 from f1 at the speeds of a truck: f2 is taken as 0",
            ],
            "converged": True,
        }

    def table(self, origin: Sequence[str]) -> str:
        """Text of a TOML file with the `[truck]` table of the gateway's configuration."""
        lines = [f"# {line}" for line in (*origin, str(self).replace("\n", "; "))]
        keys = (
            "[truck]",
            f"mass_kg = {self.mass!r}  # with its load",
            "load_kg = 0.0",
            f"f0_N = {self.f0.value:.6g}  # +- {self.f0.standard_error:.2g}",
            f"f1_N_per_m_s = {self.f1.value:.6g}  # +- {self.f1.standard_error:.2g}",
        )
        return "\n".join((*lines, *keys)) + "\n"

    def __str__(self) -> str:
        usual = "within" if self.force_error <= PRECISION else "outside"
        return (
            f"{self.forward} coast-downs forward, {self.backward} backward\n"
            f"F0 {self.f0} N\nF1 {self.f1} N s/m\ngrade and wind {self.grade} N\n"
            f"force known to {self.force_error:.2%}, {usual} the usual {PRECISION:.0%} "
            "(for comparison)"
        )


def _scale(estimate: TruckEstimate, factor: float) -> dict[str, float]:
    return {
        "value": factor * estimate.value,
        "standard_error": factor * estimate.standard_error,
    }


def roll_out(name: str, time: Array, velocity: Array) -> RollOut:
    """The part of a log in which the truck rolls out: from its fastest to its slowest speed.

    time [s], velocity [m/s], shape (n,) each; a negative velocity is the other direction
    Raises LogError for a log that shows no roll-out.
    """
    step = float(np.median(np.diff(time)))
    if step > LONGEST_SAMPLE_STEP * 1.001:
        raise LogError(f"{name}: a sample every {step:g} s; at least 10 a second are needed")
    direction = 1 if velocity[np.argmax(np.abs(velocity))] > 0.0 else -1
    speed = direction * velocity
    count = max(1, round(SMOOTHING / step))
    smooth = np.convolve(speed, np.ones(count) / count, mode="same")
    first = int(np.flatnonzero(smooth >= smooth.max() - BEGUN)[-1]) + 1
    below = np.flatnonzero(smooth[first:] < LOWEST_SPEED)
    last = first + int(below[0]) if len(below) else len(speed)
    rest = slice(first, last - count)
    if (
        rest.stop - rest.start < 2 * count
        or smooth[rest.start] - smooth[rest.stop - 1] < LEAST_FALL
    ):
        raise LogError(
            f"{name}: shows no roll-out; a fall of the speed by {LEAST_FALL:g} m/s is needed"
        )
    return RollOut(name=name, time=time[rest], speed=speed[rest], direction=direction)


def fit(runs: Sequence[RollOut], mass: float) -> CoastDown:
    """Fit the road load of a truck of this mass [kg] to its coast-downs.

    Raises LogError where all runs go in one direction.
    """
    forward = sum(run.direction > 0 for run in runs)
    if forward in (0, len(runs)):
        raise LogError(
            f"{len(runs)} coast-downs, all in one direction; as many in the other direction are "
            "needed to tell the grade (a negative velocity_m_s is the other direction)"
        )
    inertia = mass + ROTATING * (mass + DRIVER)
    columns = np.vstack([_columns(run, number, len(runs)) for number, run in enumerate(runs)])
    columns[:, :3] /= inertia
    values = np.concatenate([run.speed for run in runs])
    solution, *_ = np.linalg.lstsq(columns, values, rcond=None)
    residuals = values - columns @ solution
    covariance = _variance(residuals, runs, len(solution)) * np.linalg.inv(columns.T @ columns)
    f0, f1, grade = (
        TruckEstimate(value=float(solution[k]), standard_error=float(np.sqrt(covariance[k, k])))
        for k in range(3)
    )
    middle = np.array([1.0, float(values.mean())])
    error = float(np.sqrt(middle @ covariance[:2, :2] @ middle))
    return CoastDown(
        mass=mass,
        f0=f0,
        f1=f1,
        grade=grade,
        force_error=error / float(middle @ solution[:2]),
        forward=forward,
        backward=len(runs) - forward,
    )


def _columns(run: RollOut, number: int, count: int) -> Array:
    """Columns of F0, F1, G (times the inertia) and of the first speed of each run."""
    time = run.time - run.time[0]
    way = 0.5 * (run.speed[1:] + run.speed[:-1]) * np.diff(time)
    columns = np.zeros((len(time), 3 + count))
    columns[:, 0] = -time
    columns[1:, 1] = -np.cumsum(way)
    columns[:, 2] = -run.direction * time
    columns[:, 3 + number] = 1.0
    return columns


def _variance(residuals: Array, runs: Sequence[RollOut], unknowns: int) -> float:
    """Variance of the residuals, larger where they follow each other (first-order, per run)."""
    ends = np.cumsum([len(run.time) for run in runs])[:-1]
    parts = np.split(residuals, ends)
    follow = sum(float(part[1:] @ part[:-1]) for part in parts) / float(residuals @ residuals)
    share = min(max(follow, 0.0), 0.99)
    variance = float(residuals @ residuals) / (len(residuals) - unknowns)
    return variance * (1.0 + share) / (1.0 - share)
