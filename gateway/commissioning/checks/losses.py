"""Parasitic losses against the friction in force (40 CFR 1066.255).

At steady speed without a truck the shaft torque is the friction of the bench. What is left after
the friction that the regulator compensates is a force that the truck would feel.
"""

from collections.abc import Sequence
from math import isfinite

import numpy as np

from gateway.commissioning.check import Check, missing
from gateway.commissioning.step_run import StepRun
from gateway.configuration.config import Config
from gateway.configuration.program import Ramp, Step
from gateway.configuration.sweep_speeds import DEFAULT, RATE_RPM_S
from gateway.friction.law import idle_torque
from gateway.losses.sections import Section, steady
from register_maps.units import KMH, RPM

NAME = LABEL = "losses"
SOURCE = "for comparison: 40 CFR 1066.255, from memory"
HOLD = 6.0
"""[s] Time for which each speed is held."""


def steps(config: Config, repeats: int) -> list[Step]:  # noqa: ARG001 - all checks have these arguments
    """Steady speeds up to the limit."""
    speeds = [RPM * one for one in DEFAULT if RPM * one <= config.limits.speed_max]
    return [Ramp(speed=one, rate=RPM * RATE_RPM_S, hold=HOLD, label=LABEL) for one in speeds]


def stretches(run: StepRun) -> Sequence[Section]:
    """Steady stretches at the speeds of the sweep."""
    inside = [part for _, part in run.parts(LABEL)]
    if not inside:
        return ()
    first, last = run.trace.time[inside[0].start], run.trace.time[inside[-1].stop - 1]
    found = steady(run.trace, run.config.bench, run.config.regulator)
    return [one for one in found.sections if first <= one.start and one.end <= last]


def oil(run: StepRun, section: Section) -> float | None:
    """Temperature of the oil in the middle of a stretch [K]; None: unknown."""
    middle = 0.5 * (section.start + section.end)
    found = float(np.interp(middle, run.trace.time, run.oil_temperature))
    return found if isfinite(found) else None


def evaluate(run: StepRun) -> list[Check]:
    """Worst difference of the losses from the friction in force, and their ratio."""
    limit, found = run.config.verification.losses, stretches(run)
    if not found:
        return [missing(NAME, "no steady speed", "N", limit, SOURCE)]
    law, radius = run.config.regulator.friction, run.config.bench.drum_radius
    known = np.array(
        [idle_torque(one.gear_speed, law, one.shell_temperature, oil(run, one)) for one in found]
    )
    off = np.array([one.friction for one in found]) - known
    worst = int(np.argmax(np.abs(off)))
    ratio = 100.0 * float(np.sum(off * known) / np.sum(known * known))
    speed = found[worst].gear_speed * radius / KMH
    return [
        Check(
            name=NAME,
            what=f"losses {ratio:+.2f} % off; worst at {speed:.1f} km/h",
            value=float(off[worst]) / radius,
            unit="N",
            limit=limit,
            source=SOURCE,
        )
    ]
