"""The verification of the emulated road: one program of all checks, and its evaluation (pure)."""

from collections.abc import Sequence
from types import ModuleType
from typing import Final

from gateway.commissioning.check import Check
from gateway.commissioning.checks import (
    acceleration,
    coast_down,
    compensation,
    inertia,
    losses,
    response,
    torque,
)
from gateway.commissioning.step_run import StepRun
from gateway.configuration.config import Config
from gateway.configuration.program import Emulation, Program, Ramp, Step
from gateway.configuration.sweep_speeds import RATE_RPM_S
from gateway.errors import ConfigError
from register_maps.units import RPM

CHECKS: Final[dict[str, ModuleType]] = {
    check.NAME: check
    for check in (losses, torque, inertia, acceleration, compensation, coast_down, response)
}
"""Checks by their names: each has `steps(config, repeats)` and `evaluate(run)`."""
REPEATS: Final = 5


def verification_program(config: Config, names: Sequence[str], repeats: int = REPEATS) -> Program:
    """Program of these checks; steps that two checks share are driven once.

    Raises ConfigError for a speed or a slope over its limit.
    """
    found: list[Step] = []
    shared = dict.fromkeys(CHECKS[name].steps for name in names)
    for steps in shared:
        found += steps(config, repeats)
    for step in found:
        _refuse_fast(config, step)
        _refuse_steep(config, step)
    rate = RPM * RATE_RPM_S
    return Program(name="verification", steps=(*found, Ramp(speed=0.0, rate=rate, hold=0.0)))


def _refuse_fast(config: Config, step: Step) -> None:
    most = config.limits.speed_max
    fastest = step.speed if isinstance(step, Ramp) else 0.0
    if isinstance(step, Emulation) and step.force > 0.0 and step.label == acceleration.LABEL:
        fastest = step.fastest / config.bench.drum_radius * config.bench.gear_ratio
    if fastest > most:
        raise ConfigError(
            "the limits would clip the speed of a check",
            place="limits.speed_max_rpm",
            value=round(most / RPM),
            expected=f"at least {fastest / RPM:.0f}, or --only with other checks",
        )


def _refuse_steep(config: Config, step: Step) -> None:
    """Refuse a push that the limits would slow down: the check would blame the bench for it."""
    if not isinstance(step, Emulation):
        return
    slope = step.force / step.mass / config.bench.drum_radius * config.bench.gear_ratio
    key, most = "rate_up_rpm_s", config.limits.rate_up
    if slope < 0.0:
        key, most = "rate_down_rpm_s", config.limits.rate_down
    if abs(slope) > most:
        raise ConfigError(
            "the limits would clip the slope of a check",
            place=f"limits.{key}",
            value=round(most / RPM),
            expected=f"at least {abs(slope) / RPM:.0f}, or --only with other checks",
        )


def evaluate(run: StepRun, names: Sequence[str]) -> list[Check]:
    """Values of these checks."""
    return [one for name in names for one in CHECKS[name].evaluate(run)]
