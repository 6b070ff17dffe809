"""Findings on the register map: does it have what the regulator reads, and hold every command?"""

from collections.abc import Iterator
from typing import Final

from gateway.configuration.config import Config
from gateway.cycle.command import run_mode
from gateway.cycle.samples import NEEDS
from gateway.friction.document import EFFECTS, SENSOR
from gateway.review.finding import Finding
from register_maps.codec import CodecError, Value, encode_value
from register_maps.register_map import RegisterMap
from register_maps.signals import Control, Mode

UNENDING = 2**31
"""Count of commands that a counter without wrap must hold: 248 days at 100 Hz."""


def review_measurements(config: Config, register_map: RegisterMap) -> Iterator[Finding]:
    """Findings on the torque and the temperature that the configuration needs."""
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
    law = config.regulator.friction
    follows = law.temperature_coefficient or law.gear_oil_temperature.viscosity_coefficient
    if follows and not any(_has(register_map, f"shell_temperature_{n}") for n in (1, 2)):
        yield Finding(
            severity="warning",
            where="regulator.friction",
            what="friction depends on the shell temperature, which the register map does not have",
            value=follows,
            allowed="0 without a shell temperature",
        )
    if law.left_out:
        yield Finding(
            severity="warning",
            where="regulator.friction",
            what="effects of the parameter set that the regulator cannot use",
            value=", ".join(law.left_out),
            allowed="; ".join(EFFECTS | SENSOR),
        )
    if law.effects and config.regulator.name == "thesis":
        yield Finding(
            severity="warning",
            where="regulator.name",
            what="the regulator of the thesis leaves out " + ", ".join(law.effects),
            value="thesis",
            allowed="compensated",
        )


PROTECTIONS: Final = {
    "interlock": "an open guard, door or restraint keeps from no run",
    "alarm": "no alarm of the PLC ends a run",
    "command_sequence_echo": "a PLC that ignores the commands is not noticed, nor another master",
    "command_age": "a command of another master is not noticed before a run",
    "armature_current": "a dead or wrong torque sensor is not noticed",
    "speed_reference": "a PLC that ignores the setpoint is not noticed",
}
"""Measurement that the map may lack, and what is then missing."""
TEST_WORDS: Final = {
    "test_uint32": "exchanged words of 32-bit values are not noticed",
    "test_float32": "exchanged words of 32-bit values are not noticed",
}
"""Constants of which one is enough."""


def review_protections(_config: Config, register_map: RegisterMap) -> Iterator[Finding]:
    """Warnings for each protection that the register map does not have."""
    missing = {name: why for name, why in PROTECTIONS.items() if not _has(register_map, name)}
    if not any(_has(register_map, name) for name in TEST_WORDS):
        missing |= TEST_WORDS
    for name, why in missing.items():
        yield Finding(
            severity="warning",
            where="plc.map",
            what=f"the register map {register_map.name} has no {name}: {why}",
            value="nothing",
            allowed=f"a register of the signal {name}",
        )


def _has(register_map: RegisterMap, signal: str) -> bool:
    return register_map.register(signal) is not None


def review_commands(config: Config, register_map: RegisterMap) -> Iterator[Finding]:
    """Findings on commands that the limits allow and that do not fit into their registers.

    Such a command would be refused when it is written, in the middle of a run.
    """
    for signal, why, values in _needs(config, register_map):
        register = register_map.register(signal)
        if register is None:
            continue
        for value in values:
            try:
                encode_value(register, value)
            except CodecError as error:
                yield Finding(
                    severity="error",
                    where="plc.map",
                    what=f"register {register.name} of {register_map.name} cannot hold what "
                    f"{why} asks of it",
                    value=str(error.value),
                    allowed=error.allowed,
                )


def _needs(
    config: Config, register_map: RegisterMap
) -> Iterator[tuple[str, str, tuple[Value, ...]]]:
    """Signal, origin and extreme values in SI of every command that may come."""
    most = config.limits
    last = int(register_map.modulus("command_sequence") or UNENDING) - 1
    yield "speed_setpoint", "limits.speed_max_rpm", (0.0, most.speed_max)
    yield "speed_rate", "limits.rate_up_rpm_s", (most.rate_up,)
    yield "speed_rate", "limits.rate_down_rpm_s", (-most.rate_down,)
    yield "ramp_limit", "the larger of the limits' rates", (max(most.rate_up, most.rate_down),)
    yield "current_limit", "limits.current_limit_A", (most.current,)
    yield "watchdog_timeout", "limits.watchdog_ms", (most.watchdog,)
    yield "control", "the start", (Control(0), Control.ENABLE)
    yield "mode", "the run", (Mode.READY, run_mode(config))
    yield "map_version", "the version of the map", (register_map.version,)
    for signal in ("command_sequence", "gateway_heartbeat"):
        yield signal, "the count of commands", (0, last)
