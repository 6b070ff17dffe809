"""Acceleration of an emulated truck under a constant force (40 CFR 1066.265).

The truck has no road load. It is pushed up and down between two speeds, at three rates. A moment
without force separates the directions.
"""

from collections.abc import Iterator

import numpy as np

from gateway.commissioning.check import Check, missing
from gateway.commissioning.step_run import StepRun
from gateway.configuration.config import Config
from gateway.configuration.program import Emulation, Ramp, Step
from gateway.configuration.sweep_speeds import RATE_RPM_S
from register_maps.units import KMH, RPM

NAME = LABEL = "acceleration"
SOURCE = "40 CFR 1066.265"
RATES = (0.25, 0.5, 0.75)
"""[m/s^2] Steps of 0.25: those of a road car are too fast for the bench."""
LOWEST, HIGHEST = 3.0 * KMH, 15.0 * KMH
"""[m/s] Speeds between which a run counts."""
SPEED_MARGIN = 1.0 * KMH
"""[m/s] Speed before and after, so that the drum passes all of them."""
UNLOADED_TIME = 1.0
"""[s] Time without force before every change of direction, and time after it that does not count:
the step in force takes the drum through a part of the backlash."""
PASSED = 0.75
"""Share of the speeds that a run has to pass; the fastest is at 5 km/h when it has settled."""
TIME_SLACK = 3.0
"""Share of the expected duration after which a run that does not get there ends."""


def steps(config: Config, repeats: int) -> list[Step]:
    """Push the truck up and down, at every rate, several times."""
    bench, mass = config.bench, config.truck.total_mass
    start = (LOWEST - SPEED_MARGIN) / bench.drum_radius * bench.gear_ratio
    found: list[Step] = [Ramp(speed=start, rate=RPM * RATE_RPM_S, hold=2.0)]
    for rate in RATES * repeats:
        for sign in (1.0, -1.0):
            found += [
                _push(mass, 0.0, UNLOADED_TIME, ""),
                _push(mass, sign * mass * rate, rate, LABEL),
            ]
    return found


def _push(mass: float, force: float, scale: float, label: str) -> Step:
    """Push a truck without road load; scale : its time [s] without, its rate with a force."""
    way = HIGHEST - LOWEST + 2.0 * SPEED_MARGIN
    return Emulation(
        mass=mass,
        f0=0.0,
        f1=0.0,
        f2=0.0,
        force=force,
        slowest=LOWEST - SPEED_MARGIN if force < 0.0 else 0.0,
        fastest=HIGHEST + SPEED_MARGIN if force > 0.0 else 10.0 * HIGHEST,
        longest=TIME_SLACK * way / scale if force else scale,
        label=label,
    )


def find_pushes(run: StepRun) -> Iterator[tuple[Emulation, slice]]:
    """Pushes with their samples between the two speeds, where the drum came from end to end."""
    for step, part in run.parts(LABEL):
        inside = np.flatnonzero((run.rim_speed[part] >= LOWEST) & (run.rim_speed[part] <= HIGHEST))
        if isinstance(step, Emulation) and len(inside):
            kept = slice(part.start + int(inside[0]), part.start + int(inside[-1]) + 1)
            passed = np.ptp(run.rim_speed[kept])
            if passed > PASSED * (HIGHEST - LOWEST):
                yield step, kept


def evaluate(run: StepRun) -> list[Check]:
    """Worst and mean error of the acceleration."""
    limit = 100.0 * run.config.verification.acceleration
    errors = []
    for step, part in find_pushes(run):
        time, speed = run.trace.time[part], run.rim_speed[part]
        found = float(np.polyfit(time - time[0], speed, 1)[0])
        errors.append(100.0 * (found / (step.force / step.mass) - 1.0))
    if not errors:
        return [missing(NAME, "the drum did not pass 3 .. 15 km/h", "%", limit, SOURCE)]
    worst = max(errors, key=abs)
    what = f"worst of {len(errors)} runs; mean {np.mean(errors):+.2f} %"
    return [Check(name=NAME, what=what, value=worst, unit="%", limit=limit, source=SOURCE)]
