"""The answer of a fit of road logs: estimates, what the logs cannot separate, and problems (pure).

The logs show only the product of mass and load-cell gain. C_rr needs neither. The forces F0 and F1
are proportional to the given mass, which counts as exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.estimation.covariance import NORMAL_95
from plant_emulator.road_load.covariance import covariance_of, residual_variance
from plant_emulator.road_load.fit import LOWER, UPPER
from plant_emulator.road_load.prior import NAMES, OFFSET_STD, vector
from plant_emulator.simulation.fit_metrics import ChannelFit
from plant_emulator.simulation.fit_metrics import fit as measures

if TYPE_CHECKING:
    from plant_emulator.road_load.fit import RoadFit
    from plant_emulator.signals.log import Array

COLLINEAR = 0.95
CONTRADICTION = 4.0
"""Distance of the gain from its prior [standard deviations] that a wrong mass or ratio explains."""
EXPLAINED_VAL1 = 98.0
"""Val1 of the velocity [percent] below which the model does not describe the run."""
EXCELLENT, NOISE_FACTOR = 99.8, 3.5
"""Below this Val1 [percent] the whitened residual must be noise, with at most this long-run
variance."""
MASS = (
    "mass from torque_gain: only their product is seen; the given mass is taken as exact, f0 and "
    "f1 are proportional to it"
)
UNITS = {
    "crr": "1",
    "crr_v": "s",
    "efficiency": "1",
    "f0_newton": "N",
    "f1_newton_per_m_s": "N s/m",
    "torque_gain": "1",
    "torque_offset_Nm": "N m",
    "velocity_clock_ahead_s": "s",
    "clock_ppm": "ppm",
}


@dataclass(frozen=True, kw_only=True)
class TruckEstimate:
    """An estimated value with its standard error."""

    value: float
    standard_error: float

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % confidence interval."""
        half = NORMAL_95 * self.standard_error
        return self.value - half, self.value + half

    def __str__(self) -> str:
        return f"{self.value:.6g} +- {self.standard_error:.2g}"


@dataclass(frozen=True, kw_only=True)
class RoadAnswer:
    """The answer of a fit of road logs.

    estimates : by their names in the answer file, in the units of UNITS
    velocity : Val1 and Val2 of the simulated velocity
    not_separable : what the logs cannot separate, one sentence each
    problems : reasons against a use of the estimates; empty if there are none
    starts : number of starts that reached this optimum, number of all starts
    """

    estimates: dict[str, TruckEstimate]
    velocity: ChannelFit
    not_separable: tuple[str, ...]
    problems: tuple[str, ...]
    starts: tuple[int, int]

    @property
    def converged(self) -> bool:
        """Whether the estimates may be used."""
        return not self.problems

    def to_json(self) -> dict[str, Any]:
        """The answer as JSON types, schema truck/1."""
        values = {
            name: {
                "value": estimate.value,
                "standard_error": estimate.standard_error,
                "interval_95": list(estimate.interval),
                "unit": UNITS[name],
            }
            for name, estimate in self.estimates.items()
        }
        return {
            "schema": "truck/1",
            **values,
            "velocity": {"val1": self.velocity.val1, "val2": self.velocity.val2},
            "not_separable": list(self.not_separable),
            "starts": {"reached": self.starts[0], "tried": self.starts[1]},
            "problems": list(self.problems),
            "converged": self.converged,
        }

    def __str__(self) -> str:
        """The answer as a table for the terminal."""
        lines = [f"{'':24}{'value':>13}{'std. error':>12}{'95 % interval':>28}"]
        for name, estimate in self.estimates.items():
            low, high = estimate.interval
            numbers = f"{estimate.value:13.6g}{estimate.standard_error:12.2g}"
            lines.append(f"{name:24}{numbers}{low:14.6g}{high:14.6g}  {UNITS[name]}")
        reached, tried = self.starts
        lines += [
            f"velocity: Val1 {self.velocity.val1:.2f} %, Val2 {self.velocity.val2:.2f} %",
            f"{reached} of {tried} starts reached this optimum",
            *(f"not separable: {text}" for text in self.not_separable),
        ]
        return "\n".join(lines)


def answer_of(fit: RoadFit) -> RoadAnswer:
    """Answer of a fit."""
    covariance = covariance_of(fit)
    errors = dict(zip((NAMES[i] for i in fit.free), np.sqrt(np.diag(covariance)), strict=True))
    quality = velocity_fit(fit)
    estimates = estimates_of(fit, errors)
    return RoadAnswer(
        estimates=estimates,
        velocity=quality,
        not_separable=not_separable(fit, covariance, estimates),
        problems=tuple(problems(fit, quality)),
        starts=fit.reached,
    )


def velocity_fit(fit: RoadFit) -> ChannelFit:
    """Val1 and Val2 of the velocity, over all measured samples that both logs cover."""
    run = fit.run
    covered = (run.velocity.time >= run.time[0]) & (run.velocity.time <= run.time[-1])
    covered &= run.velocity.valid
    simulated = run.simulated_velocity(fit.values, run.velocity.time[covered])
    return measures(run.velocity.values[covered], simulated, run.velocity.source)


def estimates_of(fit: RoadFit, errors: dict[str, Any]) -> dict[str, TruckEstimate]:
    """Estimates by the names and in the units of the answer.

    F0 = m g C_rr    F1 = m g C_rr,v / r_d
    """
    truck, values = fit.run.truck, fit.values

    def estimate(name: str, factor: float = 1.0) -> TruckEstimate:
        return TruckEstimate(
            value=factor * float(getattr(values, name)), standard_error=factor * float(errors[name])
        )

    return {
        "crr": estimate("crr"),
        "crr_v": estimate("crr_v"),
        "efficiency": estimate("efficiency"),
        "f0_newton": estimate("crr", truck.weight),
        "f1_newton_per_m_s": estimate("crr_v", truck.weight / truck.drum_radius),
        "velocity_clock_ahead_s": estimate("clock_ahead"),
        "clock_ppm": estimate("clock_skew", 1e6),
        "torque_offset_Nm": estimate("torque_offset"),
        "torque_gain": estimate("torque_gain"),
    }


def not_separable(
    fit: RoadFit, covariance: Array, estimates: dict[str, TruckEstimate]
) -> tuple[str, ...]:
    """Parameters that the logs cannot separate, one sentence each."""
    found = [MASS]
    low, high = estimates["crr_v"].interval
    if low <= 0.0 <= high:
        found.append(f"crr_v from 0: its 95 % interval is {low:.2g} .. {high:.2g} s")
    gain = NAMES.index("torque_gain")
    ratio = np.sqrt(covariance[gain, gain]) / fit.prior.deviation[gain]
    if ratio > 0.5:
        found.append(
            "efficiency from torque_gain: driving and braking are both needed; the gain comes from "
            "its prior"
        )
    deviations = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(deviations, deviations)
    for i, j in combinations(range(len(fit.free)), 2):
        if abs(correlation[i, j]) > COLLINEAR:
            names = f"{NAMES[fit.free[i]]} from {NAMES[fit.free[j]]}"
            found.append(f"{names}: correlation {correlation[i, j]:.3f}")
    return tuple(found)


# Change of the load cell's zero between standstills [N m] that is 2 % of the road load.
ZERO_MOVED = 0.1


def problems(fit: RoadFit, quality: ChannelFit) -> list[str]:
    """Reasons against a use of the estimates."""
    found = [] if fit.settled else ["the search ended before it converged"]
    values = vector(fit.values)
    for index in fit.free:
        edge = 1e-6 * (UPPER[index] - LOWER[index])
        if not LOWER[index] + edge < values[index] < UPPER[index] - edge:
            found.append(f"{NAMES[index]} ended at its bound {values[index]:g}")
    if quality.val1 < EXPLAINED_VAL1:
        found.append(
            f"the truck's velocity is not explained: Val1 {quality.val1:.1f} %, at least "
            f"{EXPLAINED_VAL1:g} expected; level road, no foot brake, both logs of one run?"
        )
    elif quality.val1 < EXCELLENT and (variance := residual_variance(fit)) > NOISE_FACTOR:
        found.append(
            f"the residual is not noise, its long-run variance is {variance:.1f} times that of "
            "noise: level road, no foot brake, both logs of one run?"
        )
    spread = float(fit.prior.deviation[NAMES.index("torque_offset")])
    if ZERO_MOVED < spread < OFFSET_STD:
        found.append(
            f"the load cell's zero moves from standstill to standstill, by {spread:.2f} N m "
            "(standard deviation): cut the log where it moved"
        )
    gain = NAMES.index("torque_gain")
    distance = abs(values[gain] - 1.0) / fit.prior.deviation[gain]
    if distance > CONTRADICTION:
        found.append(
            f"the load cell's gain would be {values[gain]:.3f}, {distance:.1f} standard deviations "
            "from 1: are mass, gear ratio and wheel radius right?"
        )
    return found
