"""The command block: its number, its bits, whether it got through and the PLC has taken it over.

Writing begins in ARMED, with enable off, because the PLC starts on its rising edge; it goes on in
SAFE, so that a last command that got lost does not stay in force.
"""

from dataclasses import dataclass, replace
from math import inf

from gateway.config import Config
from gateway.limits import Limited
from gateway.reasons import Reason
from gateway.samples import LINK_IS_DOWN
from gateway.supervisor import State
from register_maps.register_map import RegisterMap
from register_maps.signals import Control, Measurement, Mode, Setpoint, Status

WRITING = frozenset({State.ARMED, State.RUN, State.RAMPDOWN, State.SAFE})
ENABLING = frozenset({State.RUN, State.RAMPDOWN})


@dataclass(frozen=True, kw_only=True)
class Command:
    """What was last written: number of the block, setpoint [rad/s], when [s]; and the PLC's echo.

    number : None: nothing written yet
    echo_moved : when the echo last changed, or the run began [s]
    got_through : when the last block was written that is known to have arrived [s]
    fault : of the first write since then that failed; down : of the last, and the link is gone
    """

    number: int | None = None
    speed: float = 0.0
    written: float = 0.0
    echo: int | None = None
    echo_moved: float = -inf
    got_through: float = -inf
    fault: Reason | None = None
    down: bool = False


def echoed(command: Command, newest: Measurement | None, now: float) -> Command:
    """Note whether the PLC has taken a command over."""
    echo = None if newest is None else newest.command_sequence_echo
    if echo is None or echo == command.echo:
        return command
    return replace(command, echo=echo, echo_moved=now)


def answered(command: Command, measurement: Measurement | None, fault: Reason | None) -> Command:
    """Note what became of the last block: a fault beside a good reading is that of the write.

    Without a reading the fault is the reading's, and tells nothing of the write before it.
    """
    if measurement is None:
        return command
    if fault is None:
        return replace(command, got_through=command.written, fault=None, down=False)
    return replace(command, fault=command.fault or fault, down=fault in LINK_IS_DOWN)


def complaint(command: Command, now: float, stale: float) -> Reason | None:
    """Why no block has got through for too long, or will; None: they do."""
    late = now - command.got_through > stale
    return command.fault if command.down or late else None


def nothing(command: Command, now: float) -> Command:
    """Nothing is written: the setpoint counts as zero."""
    return replace(command, speed=0.0, written=now)


def following(register_map: RegisterMap, command: Command, limited: Limited, now: float) -> Command:
    """The next block: one number up, the first one up from the echo, as the PLC ignores repeats."""
    last = command.echo if command.number is None else command.number
    number = (last or 0) + 1
    if span := register_map.modulus("command_sequence"):
        number %= int(span)
    return replace(command, number=number, speed=limited.speed, written=now)


def driven(config: Config) -> Mode:
    """The PLC's mode of a run: in a sweep of steady speeds nobody may drive a truck."""
    return Mode.ROAD_LOAD if config.sweep is None else Mode.SPEED


def confirmed(config: Config, status: Status) -> bool:
    """Whether the PLC is enabled, and in the mode of the run."""
    road_load = driven(config) is Mode.ROAD_LOAD
    return Status.ENABLED in status and (Status.ROAD_LOAD in status) is road_load


def block(
    config: Config, register_map: RegisterMap, command: Command, limited: Limited, *, enable: bool
) -> Setpoint:
    """The command block in SI."""
    number = command.number or 0
    return Setpoint(
        command_sequence=number,
        gateway_heartbeat=number,
        control=Control.ENABLE if enable else Control(0),
        mode=driven(config) if enable else Mode.READY,
        speed_setpoint=limited.speed,
        speed_rate=limited.rate,
        ramp_limit=max(config.limits.rate_up, config.limits.rate_down),
        current_limit=config.limits.current,
        watchdog_timeout=config.limits.watchdog,
        map_version=register_map.version,
    )
