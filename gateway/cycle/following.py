"""Does the bench do what it is told: does the reference follow the setpoint, the motor both?

The echo of the command's number only says that the PLC has read the block (pure).
"""

from dataclasses import dataclass, replace
from math import inf

from gateway.configuration.config import Config
from gateway.reasons import Reason
from register_maps.signals import Measurement

REFERENCE_WITHIN, MOTOR_WITHIN = 0.3, 0.5
"""[s] Time for which the reference may be away from the setpoint, the motor from its reference."""
NEAR, REFERENCE_DELAY = 2.0, 0.04
"""[rad/s], [s] The reference is near within the first, and what it may move in the second."""
FOLLOWED_SHARE = 0.75
"""Share of the allowed deviation of the setpoint that the motor may be away for long."""


@dataclass(frozen=True, kw_only=True)
class Following:
    """Times at which the reference was last near the setpoint, and the motor near it [s]."""

    reference: float = -inf
    motor: float = -inf


def note(
    config: Config, state: Following, sample: Measurement | None, setpoint: float, now: float
) -> Following:
    """Note a new sample beside the last setpoint [rad/s]; None: there is no new sample."""
    if sample is None:
        return state
    steepest = max(config.limits.rate_up, config.limits.rate_down)
    reference = setpoint if sample.speed_reference is None else sample.speed_reference
    if abs(reference - setpoint) <= NEAR + REFERENCE_DELAY * steepest:
        state = replace(state, reference=now)
    if abs(sample.motor_speed - reference) <= FOLLOWED_SHARE * config.limits.deviation:
        state = replace(state, motor=now)
    return state


def reason(state: Following, now: float) -> Reason | None:
    """Reason for which the bench does not follow; None: it does. now : our clock [s]."""
    if now - state.reference > REFERENCE_WITHIN:
        return Reason.NOT_FOLLOWED
    return Reason.MOTOR_ASTRAY if now - state.motor > MOTOR_WITHIN else None
