"""What a configuration lets expect of the bench, before any start: findings, worst first."""

from collections.abc import Iterator

from gateway import review_limits, review_loop
from gateway.config import Config
from gateway.finding import SEVERITIES, Finding
from gateway.samples import NEEDS
from register_maps.register_map import RegisterMap


def review(config: Config, register_map: RegisterMap) -> list[Finding]:
    """Everything there is to say, worst first."""
    found = [
        *_map(config, register_map),
        *review_loop.gain(config),
        *review_loop.stability(config),
        *review_loop.aliasing(config),
        *review_limits.timing(config),
        *review_limits.speeds(config),
        *review_limits.torque(config),
    ]
    return sorted(found, key=lambda finding: SEVERITIES.index(finding.severity))


def _map(config: Config, register_map: RegisterMap) -> Iterator[Finding]:
    needed = NEEDS[config.regulator.torque]
    if register_map.register(needed) is None:
        yield Finding(
            severity="error",
            where="regulator.torque",
            what=f"the register map {register_map.name} has no {needed}",
            value=config.regulator.torque,
            allowed=" or ".join(
                kind for kind, signal in NEEDS.items() if _has(register_map, signal)
            ),
        )
    if config.regulator.friction.temperature_coefficient and not any(
        _has(register_map, f"shell_temperature_{number}") for number in (1, 2)
    ):
        yield Finding(
            severity="warning",
            where="regulator.friction",
            what="friction depends on the shell's temperature, which the register map has not",
            value=config.regulator.friction.temperature_coefficient,
            allowed="0 without a shell temperature",
        )


def _has(register_map: RegisterMap, signal: str) -> bool:
    return register_map.register(signal) is not None
