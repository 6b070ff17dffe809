"""Gain of the shaft torque against the motor: k Phi i at steady speed.

The torque sensor is the scale of everything that the regulator feels. The armature current is the
only other torque on the bench. It is as good as the known flux, so that the limit is wide.
"""

import numpy as np

from gateway.commissioning.check import Check, missing
from gateway.commissioning.checks import losses
from gateway.commissioning.step_run import StepRun
from gateway.physics.motor import flux

NAME, LABEL = "torque", losses.LABEL
SOURCE = "own limit; the motor's flux is the scale"
steps = losses.steps


def evaluate(run: StepRun) -> list[Check]:
    """Gain of the torque sensor over the motor's torque, from all steady speeds."""
    limit, found = 100.0 * run.config.verification.torque, losses.stretches(run)
    time = run.trace.time
    current = [float(run.current[(time >= one.start) & (time <= one.end)].mean()) for one in found]
    if not found or not np.isfinite(current).all():
        what = "no steady speed with a current"
        return [missing(NAME, what, "%", limit, SOURCE)]
    speeds = np.array([one.motor_speed for one in found])
    motor = flux(run.config.bench, speeds) * np.array(current)
    sensor = -np.array([one.shaft_torque for one in found])
    gain = float(np.sum(sensor * motor) / np.sum(motor * motor))
    return [
        Check(
            name=NAME,
            what="shaft torque over motor torque",
            value=100.0 * (gain - 1.0),
            unit="%",
            limit=limit,
            source=SOURCE,
        )
    ]
