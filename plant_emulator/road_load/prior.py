"""The prior of a truck's parameters, and the starts of the fits (pure).

The prior holds the load cell's gain within its calibration, the load cell's offset at standstill,
a difference of about 100 ppm between the two clocks, and a small C_rr,v. The starts are a
regression of the acceleration on the torque (which needs no simulation), the values of the thesis,
and four points around the regression.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from plant_emulator.road_load.signal import low_pass
from plant_emulator.road_load.truck_model import RoadParameters
from plant_emulator.simulation.truck import GRAVITY

if TYPE_CHECKING:
    from plant_emulator.road_load.run import RoadRun
    from plant_emulator.signals.log import Array

Indices = NDArray[np.int64]

NAMES = tuple(RoadParameters.__dataclass_fields__)
CLOCK_SKEW = 100e-6
"""Prior standard deviation of the relative rate of two free-running clocks [1]."""
CRR_V = 1e-3
"""Prior standard deviation of C_rr,v [s]; at 14 km/h it is half of C_rr."""
OFFSET_STD = 1.0
"""Prior standard deviation of the load cell's offset without a standstill [N m]."""
LEAST_STANDSTILL = 0.3
"""Shortest standstill that shows the load cell's offset [s]."""


@dataclass(frozen=True, kw_only=True)
class Prior:
    """Prior means and standard deviations in order of NAMES, shape (parameters,) each.

    An infinite deviation means that the parameter has no prior.
    """

    mean: Array
    deviation: Array


def vector(values: RoadParameters) -> Array:
    """Values as an array in order of NAMES."""
    return np.array(astuple(values), dtype=np.float64)


def parameters(values: Array) -> RoadParameters:
    """Record of an array in order of NAMES."""
    return RoadParameters(**dict(zip(NAMES, values.tolist(), strict=True)))


def prior_of(run: RoadRun, gain_deviation: float) -> Prior:
    """Prior of a run.

    gain_deviation : prior standard deviation of the load cell's gain from 1 [1]
    """
    mean, deviation = np.zeros(len(NAMES)), np.full(len(NAMES), np.inf)
    priors = {
        "torque_gain": (1.0, gain_deviation),
        "clock_skew": (0.0, CLOCK_SKEW),
        "crr_v": (0.0, CRR_V),
        "torque_offset": standstill_offset(run),
    }
    for name, (value, spread) in priors.items():
        mean[NAMES.index(name)], deviation[NAMES.index(name)] = value, spread
    return Prior(mean=mean, deviation=deviation)


def standstill_offset(run: RoadRun) -> tuple[float, float]:
    """Measured torque while the truck stands, and its standard error [N m].

    The standard error is that of the noise, or the scatter between the standstills if this is
    larger, because a load cell drifts.
    """
    edges = np.flatnonzero(np.diff(np.r_[False, run.held, False].astype(np.int8)))
    rests = [run.torque.values[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True)]
    count = np.array([len(rest) for rest in rests])
    if count.sum() * run.torque.period < LEAST_STANDSTILL:
        return 0.0, OFFSET_STD
    shown = np.concatenate(rests)
    means = np.array([rest.mean() for rest in rests])
    mean = float(shown.mean())
    error = max(float(shown.std()), 1e-4) / float(np.sqrt(len(shown)))
    if len(rests) > 1:
        among = np.sum(count * (means - mean) ** 2) / ((len(rests) - 1) * count.sum())
        error = max(error, float(np.sqrt(among)))
    return mean, error


def starts(run: RoadRun, prior: Prior) -> list[RoadParameters]:
    """Starts of the fits."""
    near = regression(run, prior)
    plain = replace(near, crr=0.0117, crr_v=0.0, efficiency=0.9, torque_gain=1.0)
    around = [(0.6, 0.93, 0.02), (1.5, 1.05, -0.02), (0.8, 1.05, 0.05), (1.25, 0.93, -0.05)]
    moved = [
        replace(
            near,
            crr=near.crr * crr,
            efficiency=min(near.efficiency * efficiency, 0.99),
            clock_ahead=near.clock_ahead + shift,
        )
        for crr, efficiency, shift in around
    ]
    return [near, replace(plain, clock_ahead=0.0), *moved]


def regression(run: RoadRun, prior: Prior) -> RoadParameters:
    """Start from a regression of acceleration on driving torque, braking torque and direction.

    dv/dt = xi eta / (r_w m gain) T+ + xi / (eta r_w m gain) T- - g C_rr sgn v
    """
    truck, offset = run.truck, float(prior.mean[NAMES.index("torque_offset")])
    period = float(np.median(np.diff(run.time)))
    speed = low_pass(run.measured, period, 4.0)
    shown = low_pass(run.torque.values, run.torque.period, 4.0) - offset
    torque = np.interp(run.time + run.ahead, run.torque.time, shown)
    used = run.valid & (np.abs(speed) > 0.3)
    sign = np.sign(speed)
    drives = torque * sign > 0.0
    columns = np.stack([np.where(drives, torque, 0.0), np.where(drives, 0.0, torque), -sign], 1)
    found = np.linalg.lstsq(columns[used], np.gradient(speed, period)[used])[0]
    lossless = truck.ratio / (truck.wheel_radius * truck.mass)
    driving, braking = (float(value) / lossless for value in found[:2])
    plausible = 0.2 < driving < 2.0 and driving < braking < 4.0
    return RoadParameters(
        crr=float(np.clip(found[2] / GRAVITY, 1e-3, 0.1)),
        crr_v=0.0,
        efficiency=float(np.clip(np.sqrt(driving / braking), 0.5, 0.99)) if plausible else 0.9,
        torque_gain=(
            float(np.clip(1.0 / np.sqrt(driving * braking), 0.8, 1.25)) if plausible else 1.0
        ),
        torque_offset=offset,
        clock_ahead=run.ahead,
        clock_skew=0.0,
        initial_velocity=float(speed[0]) if run.moving_start else 0.0,
    )
