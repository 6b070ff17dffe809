"""What a configuration lets expect of the bench, before any start: findings, worst first."""

from gateway.configuration.config import Config
from gateway.review import review_bounds, review_limits, review_loop, review_map
from gateway.review.finding import SEVERITIES, Finding
from register_maps.register_map import RegisterMap


def review(config: Config, register_map: RegisterMap) -> list[Finding]:
    """Everything there is to say, worst first."""
    found = [
        *review_map.measurements(config, register_map),
        *review_map.commands(config, register_map),
        *review_loop.gain(config),
        *review_loop.stability(config),
        *review_loop.aliasing(config),
        *review_limits.timing(config),
        *review_limits.speeds(config),
        *review_limits.torque(config),
        *review_bounds.limits(config),
        *review_bounds.bench(config),
    ]
    return sorted(found, key=lambda finding: SEVERITIES.index(finding.severity))
