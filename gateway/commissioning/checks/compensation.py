"""Compensation of the friction (40 CFR 1066.260): the bare bench keeps its speed.

The regulator emulates a truck of the bench's own inertia without road load, which rolls for a
minute. What slows it down, or speeds it up, is the part of the friction that is not compensated.
"""

from dataclasses import replace

from gateway.commissioning.check import Check, missing
from gateway.commissioning.checks import coast_down
from gateway.commissioning.step_run import StepRun
from gateway.configuration.config import Config
from gateway.configuration.program import Emulation, Step

NAME = LABEL = "compensation"
SOURCE = "40 CFR 1066.260"
DURATION, SETTLE = 60.0, 2.0
"""[s] Time for which the truck rolls, and its first part, which does not count."""


def steps(config: Config, repeats: int) -> list[Step]:  # noqa: ARG001 - all checks have these arguments
    """Let a truck of the bench's own inertia roll without road load."""
    bench = config.bench
    mass = (bench.drum_inertia + bench.gear_inertia) / bench.drum_radius**2
    rolling = replace(
        coast_down.roll_out(config, mass), f0=0.0, f1=0.0, f2=0.0, longest=DURATION, label=LABEL
    )
    return [coast_down.start(config), rolling]


def evaluate(run: StepRun) -> list[Check]:
    """Mean force that acts on the truck."""
    limit = run.config.verification.compensation
    for step, part in run.parts(LABEL):
        time, speed = run.trace.time[part], run.rim_speed[part]
        rolls = time >= time[0] + SETTLE
        time, speed = time[rolls], speed[rolls]
        if isinstance(step, Emulation) and len(time) > 1:
            force = float(-step.mass * (speed[-1] - speed[0]) / (time[-1] - time[0]))
            what = f"{step.mass:.0f} kg without road load, {time[-1] - time[0]:.0f} s"
            return [Check(name=NAME, what=what, value=force, unit="N", limit=limit, source=SOURCE)]
    return [missing(NAME, "the truck did not roll", "N", limit, SOURCE)]
