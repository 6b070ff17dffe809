"""Checks whether logs are of one bench, by what no run, load or temperature changes (pure).

While the gear drives or brakes the drum, one flank of the backlash is in contact, and gear and drum
turn together. The motor has turned by the angle theta, counted behind the gear. The drum lags
behind it by the angle

    delta = delta_0 + s theta + tau omega_d + k/2 omega_d |omega_d| + J_d omega_d' / k_gd + f alpha

f is 1 on the driving flank and -1 on the braking flank (thesis, eq. 3.27 and 3.34). s is the share
by which the drum shows less than the gear ratio says. A wrong scale of a speed sensor or another
gear ratio changes s. A fit determines s together with the lag tau and the slip k of the measuring
wheel and the half gap alpha. The equation holds no torque, current or friction, hence nothing that
oil or windings change. The noise of delta is the integral of the noise of the speeds: a random
walk, whose increments are white. A truck on the drum hides which flank is in contact, so a run with
a truck gives no s.

The s of two logs may differ by their errors and by the error of this equation. If they differ by
more, the logs are of two benches, or the bench was changed between them. A diagnosis of both logs
together would then have no answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.signals.log import has_truck
from plant_emulator.signals.noise import noise
from plant_emulator.signals.smoothing import smooth

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array, Log

# Smoothing before the derivative, and time of contact around a sample that counts [s].
SPEED_SMOOTHING, CONTACT_TIME = 0.2, 0.2
# Acceleration of the drum from which on the gear drives it, and from which on the gear brakes it
# [rad/s^2]. The first is above the noise. The second is above what bearings do to a drum that
# floats in the gap.
DRIVEN_ACCELERATION, BRAKED_ACCELERATION = 0.25, 0.75
# In contact, gear and drum differ by less than this [rad/s], plus this share of their speed, plus
# what a lag of this time makes of their acceleration [s].
CONTACT_SPEED, CONTACT_SHARE, CONTACT_LAG = 0.03, 0.02, 0.1
# Time between the samples that are taken [s], and the least number of such samples.
SPACING, LEAST_CONTACT_SAMPLES = 0.05, 20
# Error of delta that smoothing leaves, beside the noise of the speeds [rad].
SMOOTHING_ERROR = 3e-4
# Prior standard deviations of s, tau [s], k [s^2/rad] and alpha [rad]: wide.
PRIOR_STD = np.array([0.05, 0.05, 0.01, 0.3])
# Error of s that the equation of the contact makes, a standard deviation.
EQUATION_ERROR = 1e-3
# Standard errors from which on two logs are not of one bench.
BENCH_DIFFERENCE = 6.0


@dataclass(frozen=True, kw_only=True)
class SpeedDeficit:
    """The share s of a log with its standard error."""

    source: str
    share: float
    error: float


def check_same_bench(logs: Sequence[Log], values: Mapping[str, float]) -> None:
    """Raise LogError if two logs cannot be of one bench; values : of all parameters [SI]."""
    found = [deficit for log in logs if (deficit := speed_deficit_of(log, values)) is not None]
    for first, second in combinations(found, 2):
        error = float(np.sqrt(first.error**2 + second.error**2 + EQUATION_ERROR**2))
        apart = abs(first.share - second.share) / error
        if apart > BENCH_DIFFERENCE:
            raise LogError(
                f"{second.source}: drum speed over motor speed is {_percent(second)} what the gear "
                f"ratio says while the gear drives, and {_percent(first)} in {first.source}: "
                f"{apart:.0f} standard errors apart; give logs of one bench, unchanged between them"
            )


def _percent(deficit: SpeedDeficit) -> str:
    return f"{100.0 * (1.0 - deficit.share):.2f} %"


def speed_deficit_of(log: Log, values: Mapping[str, float]) -> SpeedDeficit | None:
    """Share by which the drum shows less than the gear ratio says [1]; None where none is found."""
    if has_truck(log):
        return None
    gear_speed, drum_speed = log["motor_speed"] / values["gear_ratio"], log["drum_speed"]
    period = float(np.median(np.diff(log.time)))
    speed, driven = (smooth(log.time, drum_speed, SPEED_SMOOTHING, order) for order in (0, 1))
    faster = driven * np.sign(speed)
    flank = np.sign(driven) * ((faster > DRIVEN_ACCELERATION) | (faster < -BRAKED_ACCELERATION))
    apart = np.abs(smooth(log.time, gear_speed - drum_speed, SPEED_SMOOTHING))
    together = CONTACT_SPEED + CONTACT_SHARE * np.abs(speed) + CONTACT_LAG * np.abs(driven)
    counts = _steady(flank, CONTACT_TIME / period) & (apart < together)
    index = np.flatnonzero(counts)[:: max(1, round(SPACING / period))]
    if len(index) < LEAST_CONTACT_SAMPLES:
        return None
    delta = _sum(gear_speed - drum_speed, log.time)
    delta = delta - values["drum_inertia"] * driven / values["drum_shaft_stiffness"]
    theta = _sum(gear_speed, log.time)
    columns = np.stack([theta, speed, 0.5 * speed * np.abs(speed), flank], axis=1)
    walk = period * float(np.hypot(noise(drum_speed), noise(gear_speed)))
    sigma = np.sqrt(walk**2 * np.diff(index) + SMOOTHING_ERROR**2)
    share, error = _first(
        np.diff(columns[index], axis=0) / sigma[:, None], np.diff(delta[index]) / sigma
    )
    return SpeedDeficit(source=log.source, share=share, error=error)


def _sum(values: Array, time: Array) -> Array:
    """Integral by the trapezoidal rule, 0 at the first sample."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])


def _steady(flank: Array, reach: float) -> NDArray[np.bool_]:
    """Mask of the samples whose flank stays in contact; reach : before and after [samples]."""
    edges = np.flatnonzero(np.diff(flank)) + 1
    found = np.zeros(len(flank), bool)
    margin = round(reach)
    for first, last in zip([0, *edges], [*edges, len(flank)], strict=True):
        found[first + margin : max(first + margin, last - margin)] = flank[first] != 0.0
    return found


def _first(rows: Array, wanted: Array) -> tuple[float, float]:
    """First coefficient of a fit with the prior, and its standard error after the residual."""
    normal = rows.T @ rows + np.diag(PRIOR_STD**-2.0)
    found = np.linalg.solve(normal, rows.T @ wanted)
    left = float(np.mean((wanted - rows @ found) ** 2))
    return float(found[0]), float(np.sqrt(np.linalg.inv(normal)[0, 0] * max(1.0, left)))
