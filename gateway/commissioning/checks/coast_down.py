"""Virtual coast-downs of the smallest and the largest truck (40 CFR 1066.270).

No truck stands on the drum. The regulator emulates one that rolls out under its road load. The mean
force of an interval of speeds is m dv / dt. It has to be the road load in two consecutive
coast-downs (WLTP: EU 2017/1151, sub-annex 4). One alone does not show that the bench repeats it.
"""

from collections.abc import Sequence

import numpy as np

from gateway.arrays import Array
from gateway.commissioning.check import Check, missing
from gateway.commissioning.step_run import StepRun
from gateway.configuration.config import Config
from gateway.configuration.program import Emulation, Ramp, Step
from gateway.configuration.sweep_speeds import RATE_RPM_S
from gateway.physics.road_load import GRAVITY
from register_maps.units import KMH, RPM

NAME = LABEL = "coast-down"
SOURCE = "for comparison: 40 CFR 1066.270, from memory"
SPEED_BOUNDS: Array = np.arange(16.0, 3.0, -2.0) * KMH
"""[m/s] Speeds between which a mean force is taken."""
SPEED_MARGIN = 1.0 * KMH
LONGEST_COAST = 180.0
FEWEST, MOST = 2, 4
"""Coast-downs of each truck: two in a row have to hold; the first may find a colder gear."""


def start(config: Config) -> Step:
    """Ramp to the speed from which a truck rolls out."""
    bench = config.bench
    speed = (float(SPEED_BOUNDS[0]) + SPEED_MARGIN) / bench.drum_radius * bench.gear_ratio
    return Ramp(speed=speed, rate=RPM * RATE_RPM_S, hold=3.0)


def steps(config: Config, repeats: int) -> list[Step]:
    """Let the smallest and the largest truck roll out, each FEWEST to MOST times."""
    number = min(max(repeats, FEWEST), MOST)
    masses = (config.verification.smallest, config.verification.largest)
    return [one for mass in masses for one in (start(config), roll_out(config, mass)) * number]


def roll_out(config: Config, mass: float) -> Emulation:
    """Let a truck of this mass roll out; its road load grows with the mass."""
    own, weight = config.truck, mass * GRAVITY
    share = mass / own.total_mass
    rolls = own.f0 is None
    return Emulation(
        mass=mass,
        f0=own.crr * weight if own.f0 is None else share * own.f0,
        f1=own.crr_v * weight / config.bench.drum_radius if rolls else share * (own.f1 or 0.0),
        f2=0.0 if rolls else share * (own.f2 or 0.0),
        force=0.0,
        slowest=float(SPEED_BOUNDS[-1]) - 0.5 * SPEED_MARGIN,
        fastest=2.0 * float(SPEED_BOUNDS[0]),
        longest=LONGEST_COAST,
        label=LABEL,
    )


def mean_forces(time: Array, speed: Array, mass: float, bounds: Array) -> Array:
    """Mean force of each interval of speeds [N], shape (n - 1,); NaN where it was not passed.

    time [s], speed [m/s] of a truck that slows down; bounds : falling speeds [m/s], shape (n,)
    """
    falling = np.minimum.accumulate(speed)
    passed = np.interp(-bounds, -falling, time, left=np.nan, right=np.nan)
    return mass * -np.diff(bounds) / np.diff(passed)


def targets(step: Emulation, bounds: Array) -> Array:
    """Mean road load of each interval of speeds [N], shape (n - 1,)."""
    high, low = bounds[:-1], bounds[1:]
    squares = (high**2 + high * low + low**2) / 3.0
    return step.f0 + step.f1 * 0.5 * (high + low) + step.f2 * squares


def evaluate(run: StepRun) -> list[Check]:
    """Worst error of the mean force of each truck, in two coast-downs in a row."""
    trucks: dict[float, list[tuple[Emulation, slice]]] = {}
    for step, part in run.parts(LABEL):
        if isinstance(step, Emulation):
            trucks.setdefault(step.mass, []).append((step, part))
    return [_judge(run, coasts) for coasts in trucks.values()] or [
        missing(NAME, "no coast-down", "N", run.config.verification.coast_down, SOURCE)
    ]


def _judge(run: StepRun, coasts: Sequence[tuple[Emulation, slice]]) -> Check:
    """Judge the first two coast-downs in a row that hold, or the two that come nearest to it."""
    limit, step, count = run.config.verification.coast_down, coasts[0][0], len(coasts)
    wanted = targets(step, SPEED_BOUNDS)
    errors = np.array([_forces(run, *one) - wanted for one in coasts])
    worst = np.abs(errors).max(axis=1)
    pairs = np.maximum(worst[:-1], worst[1:])
    if not np.isfinite(pairs).any():
        what = f"{step.mass:.0f} kg: not twice in a row from 16 to 4 km/h"
        return missing(NAME, what, "N", limit, SOURCE)
    within = np.flatnonzero(pairs <= limit)
    first = int(within[0]) if len(within) else int(np.nanargmin(pairs))
    pair = errors[first : first + 2].ravel()
    at = int(np.argmax(np.abs(pair)))
    value, interval = float(pair[at]), at % len(wanted)
    needed = str(first + 2) if len(within) else "none"
    what = (
        f"{step.mass:.0f} kg in {needed} of {count} runs, "
        f"{100.0 * value / wanted[interval]:+.1f} % of {wanted[interval]:.0f} N at "
        f"{SPEED_BOUNDS[interval] / KMH:.0f} .. {SPEED_BOUNDS[interval + 1] / KMH:.0f} km/h"
    )
    return Check(name=NAME, what=what, value=value, unit="N", limit=limit, source=SOURCE)


def _forces(run: StepRun, step: Emulation, part: slice) -> Array:
    return mean_forces(run.trace.time[part], run.rim_speed[part], step.mass, SPEED_BOUNDS)
