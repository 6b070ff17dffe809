"""Response to a step in force (40 CFR 1066.245): when the motor accelerates as the force asks.

A truck that rolls without force is pushed at once. Dynamometers have to settle within 10 % in 100
ms. On this bench the dead time alone takes 64 ms, and then the drum passes a part of the backlash.
So the time of rise and the time to settle have limits of their own.
"""

from dataclasses import replace
from math import nan

import numpy as np

from gateway.commissioning.check import Check, missing
from gateway.commissioning.checks import coast_down
from gateway.commissioning.step_run import StepRun
from gateway.configuration.config import Config
from gateway.configuration.program import Emulation, Ramp, Step
from gateway.configuration.sweep_speeds import RATE_RPM_S
from register_maps.units import KMH, RPM

NAME = LABEL = "response"
SOURCE = "own limit; 40 CFR 1066.245: settled in 100 ms"
PUSH_RATE = 0.5
"""[m/s^2] Acceleration of the step."""
START = 6.0 * KMH
"""[m/s] Speed at which the force begins."""
REST_TIME, PUSH = 2.0, 2.0
SETTLING_LIMIT = 0.1
AVERAGING_TIME = 0.05
"""[s] Time over which an acceleration is taken; the speed has digits of 0.02 rad/s."""


def steps(config: Config, repeats: int) -> list[Step]:  # noqa: ARG001 - all checks have these arguments
    """Push the smallest and the largest truck."""
    bench, found = config.bench, list[Step]()
    speed = START / bench.drum_radius * bench.gear_ratio
    for mass in (config.verification.smallest, config.verification.largest):
        free = replace(
            coast_down.roll_out(config, mass), f0=0.0, f1=0.0, f2=0.0, slowest=0.0, label=""
        )
        found += [
            Ramp(speed=speed, rate=RPM * RATE_RPM_S, hold=2.0),
            replace(free, longest=REST_TIME),
            replace(free, force=mass * PUSH_RATE, longest=PUSH, label=LABEL),
        ]
    return found


def rise_and_settling(run: StepRun, step: Emulation, part: slice) -> tuple[float, float]:
    """Times from the force to 90 % of its acceleration, and to within 10 % for good [s].

    NaN where that does not happen. The force acts in the window that ends at the first sample.
    """
    bench = run.config.bench
    count = max(1, round(AVERAGING_TIME / float(np.median(np.diff(run.trace.time[part])))))
    time, speed = run.trace.time[part], run.trace.motor_speed[part]
    since = 0.5 * (time[count:] + time[:-count]) - run.trace.time[max(part.start - 1, 0)]
    rate = (speed[count:] - speed[:-count]) / (time[count:] - time[:-count])
    share = rate / (step.force / step.mass / bench.drum_radius * bench.gear_ratio)
    risen = np.flatnonzero(share >= 1.0 - SETTLING_LIMIT)
    outside = np.flatnonzero(np.abs(share - 1.0) > SETTLING_LIMIT)
    last = int(outside[-1]) + 1 if len(outside) else 0
    return (
        float(since[risen[0]]) if len(risen) else nan,
        float(since[last]) if last < len(since) else nan,
    )


def evaluate(run: StepRun) -> list[Check]:
    """Times of rise and to settle of each truck."""
    limits = run.config.verification
    found = []
    for step, part in run.parts(LABEL):
        if isinstance(step, Emulation):
            rise, settling = rise_and_settling(run, step, part)
            found += [
                _check(f"{step.mass:.0f} kg: rise to 90 %", rise, limits.response),
                _check(f"{step.mass:.0f} kg: settled to 10 %", settling, limits.settling),
            ]
    return found or [missing(NAME, "no step in force", "ms", 1e3 * limits.response, SOURCE)]


def _check(what: str, time: float, limit: float) -> Check:
    return Check(
        name=NAME, what=what, value=1e3 * time, unit="ms", limit=1e3 * limit, source=SOURCE
    )
