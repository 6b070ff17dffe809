"""The review of a configuration before any start: what it lets one expect of the bench."""

from gateway.configuration.config import Config
from gateway.review import bounds, limits, loop, registers
from gateway.review.finding import SEVERITIES, Review
from register_maps.register_map import RegisterMap


def review(config: Config, register_map: RegisterMap) -> Review:
    """Review limits, times, loop stability and register map; the worst finding comes first."""
    found = [
        *registers.measurements(config, register_map),
        *registers.commands(config, register_map),
        *registers.protections(config, register_map),
        *loop.gain(config),
        *loop.stability(config),
        *loop.aliasing(config),
        *limits.timing(config),
        *limits.speeds(config),
        *limits.torque(config),
        *bounds.limits(config),
        *bounds.bench(config),
    ]
    found.sort(key=lambda finding: SEVERITIES.index(finding.severity))
    return Review(findings=tuple(found))
