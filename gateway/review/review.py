"""What a configuration lets expect of the bench, before any start: findings, worst first."""

from gateway.configuration.config import Config
from gateway.review import bounds, limits, loop, registers
from gateway.review.finding import SEVERITIES, Finding
from register_maps.register_map import RegisterMap


def review(config: Config, register_map: RegisterMap) -> list[Finding]:
    """Everything there is to say, worst first."""
    found = [
        *registers.measurements(config, register_map),
        *registers.commands(config, register_map),
        *loop.gain(config),
        *loop.stability(config),
        *loop.aliasing(config),
        *limits.timing(config),
        *limits.speeds(config),
        *limits.torque(config),
        *bounds.limits(config),
        *bounds.bench(config),
    ]
    return sorted(found, key=lambda finding: SEVERITIES.index(finding.severity))
