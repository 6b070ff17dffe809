"""Base inertia of gear and drum (40 CFR 1066.250: I = F dt / (v2 - v1)).

The torque that accelerates the bench is the shaft torque less the friction. A run up and a run down
between the same speeds share one error of the friction, so that each pair gives the inertia without
it:

    W_up = J dw + (1 + s) F_up,  W_down = -J dw + (1 + s) F_down

with W = -integral xi T_meas dt and F = integral T_f dt over each run. The share s drops out.
"""

import numpy as np

from gateway.arrays import Array
from gateway.commissioning.check import Check, missing
from gateway.commissioning.checks import acceleration
from gateway.commissioning.step_run import StepRun
from gateway.friction.law import idle_torque

NAME, LABEL = "inertia", acceleration.LABEL
SOURCE = "40 CFR 1066.250"
steps = acceleration.steps


def inertias(run: StepRun) -> Array:
    """Inertia of gear and drum [kg m^2] of every pair of a run up and a run down."""
    pushes = list(acceleration.find_pushes(run))
    pairs = zip(pushes[::2], pushes[1::2], strict=False)
    return np.array([_inertia(run, up[1], down[1]) for up, down in pairs])


def _inertia(run: StepRun, up: slice, down: slice) -> float:
    rise, work_up, loss_up = _integrals(run, up)
    fall, work_down, loss_down = _integrals(run, down)
    return (work_up * loss_down - work_down * loss_up) / (rise * loss_down - fall * loss_up)


def _integrals(run: StepRun, part: slice) -> tuple[float, float, float]:
    """Change of the drum's speed [rad/s], and integrals of shaft and friction torque [N m s].

    The torque is that of the window that ends at its sample.
    """
    bench, regulator = run.config.bench, run.config.regulator
    time, drum = run.trace.time[part], run.trace.drum_speed[part]
    duration = np.diff(time)
    torque = regulator.shaft_torque(run.trace.shaft_torque[part][1:])
    gear = run.trace.motor_speed[part] / bench.gear_ratio
    friction = np.array([idle_torque(float(one), regulator.friction) for one in gear])
    loss = float(np.sum(0.5 * (friction[1:] + friction[:-1]) * duration))
    return float(drum[-1] - drum[0]), float(-bench.gear_ratio * np.sum(torque * duration)), loss


def evaluate(run: StepRun) -> list[Check]:
    """Worst and mean error of the configured inertia."""
    bench, limits = run.config.bench, run.config.verification
    found = inertias(run)
    each, mean = 100.0 * limits.inertia, 100.0 * limits.inertia_mean
    if not len(found):
        return [missing(NAME, "no pair of runs up and down", "%", each, SOURCE)]
    known = bench.drum_inertia + bench.gear_inertia
    errors = 100.0 * (found / known - 1.0)
    worst = float(errors[np.argmax(np.abs(errors))])
    kilograms = float(found.mean()) / bench.drum_radius**2
    rows = (
        (f"worst of {len(errors)} pairs of runs", worst, each),
        (f"mean; {kilograms:.1f} kg at the rim", float(errors.mean()), mean),
    )
    return [
        Check(name=NAME, what=what, value=value, unit="%", limit=limit, source=SOURCE)
        for what, value, limit in rows
    ]
