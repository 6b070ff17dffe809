"""The review of a configuration before any start: what it lets one expect of the bench."""

from gateway.configuration.config import Config
from gateway.review import bounds, limits, loop, registers
from gateway.review.finding import SEVERITIES, Review
from register_maps.register_map import RegisterMap


def review(config: Config, register_map: RegisterMap) -> Review:
    """Review limits, times, loop stability and register map; the worst finding comes first."""
    found = [
        *registers.review_measurements(config, register_map),
        *registers.review_commands(config, register_map),
        *registers.review_protections(config, register_map),
        *loop.review_gain(config),
        *loop.review_stability(config),
        *loop.review_aliasing(config),
        *limits.review_timing(config),
        *limits.review_speeds(config),
        *limits.review_torque(config),
        *bounds.review_limits(config),
        *bounds.review_bench(config),
    ]
    found.sort(key=lambda finding: SEVERITIES.index(finding.severity))
    return Review(findings=tuple(found))
