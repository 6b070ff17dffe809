"""The command block: its number, its bits, whether it got through and the PLC has taken it over.

Writing begins in ARMED, with enable off, because the PLC starts on its rising edge; it goes on in
SAFE, so that a last command that got lost does not stay in force.
"""

from dataclasses import dataclass, replace
from math import inf

from gateway.configuration.config import Config
from gateway.cycle.limits import Limited
from gateway.cycle.samples import LINK_IS_DOWN
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from register_maps.register_map import RegisterMap
from register_maps.signals import Control, Measurement, Mode, Setpoint, Status

WRITING = frozenset({State.ARMED, State.RUN, State.RAMPDOWN, State.SAFE})
ENABLING = frozenset({State.RUN, State.RAMPDOWN})
NOT_BY_WAITING = LINK_IS_DOWN | {Reason.NOT_ENCODABLE}
"""Faults that the next write will meet as well."""
RECENT, JITTER = 0.25, 0.1
"""[s] Age of a command that somebody still writes: the slowest gateway does so every 0.2 s; and by
how much it has to be younger than our last one."""
MICRO, NUMBERS = 1e6, 30011
"""Parts of a second, and how many first numbers there are: a prime, so that no period shows."""


@dataclass(frozen=True, kw_only=True)
class Command:
    """What was last written: number of the block, setpoint [rad/s], when [s]; and the PLC's echo.

    number : None: nothing written yet
    sent : when a block was last written [s]; unanswered : how many since the one echoed last
    echo_moved : when the echo last changed, or the run began [s]
    other_wrote : when the PLC last took over a block that is not ours [s]
    got_through : when the last block was written that is known to have arrived [s]
    fault : of the first write since then that failed; down : the last, and waiting does not help
    """

    number: int | None = None
    speed: float = 0.0
    written: float = 0.0
    sent: float = -inf
    unanswered: int = 0
    echo: int | None = None
    echo_moved: float = -inf
    other_wrote: float = -inf
    got_through: float = -inf
    fault: Reason | None = None
    down: bool = False


def note_echo(
    register_map: RegisterMap, command: Command, sample: Measurement | None, now: float
) -> Command:
    """Note which command the PLC has taken over by a new sample, and whether it was one of ours."""
    if sample is None:
        return command
    if _other_master_wrote(command, sample.command_age, now):
        command = replace(command, other_wrote=now)
    echo, before = sample.command_sequence_echo, command.echo
    if echo is None or echo == before:
        return command
    moved = replace(command, echo=echo, echo_moved=now)
    since = _blocks_since(register_map, command, echo)
    if since is not None:
        return replace(moved, unanswered=since)
    return moved if before is None else replace(moved, other_wrote=now)


def _other_master_wrote(command: Command, age: float | None, now: float) -> bool:
    """Whether the PLC has taken a command over after our last one, of `age` [s] now."""
    return age is not None and age < RECENT and now - command.sent > age + JITTER


def _blocks_since(register_map: RegisterMap, command: Command, echo: int) -> int | None:
    """How many blocks have been written after the one that is echoed; None: it is not ours."""
    if command.number is None:
        return None
    since = command.number - echo
    if span := register_map.modulus("command_sequence"):
        since %= int(span)
    return since if since in range(command.unanswered) else None


def note_reply(command: Command, measurement: Measurement | None, fault: Reason | None) -> Command:
    """Note what became of the last block: a fault beside a good reading is that of the write.

    Without a reading the fault is the reading's, and tells nothing of the write before it.
    """
    if measurement is None:
        return command
    if fault is None:
        return replace(command, got_through=command.written, fault=None, down=False)
    return replace(command, fault=command.fault or fault, down=fault in NOT_BY_WAITING)


def fault(command: Command, now: float, stale: float) -> Reason | None:
    """Why no block has got through for too long, or will; None: they do."""
    late = now - command.got_through > stale
    return command.fault if command.down or late else None


def reset(command: Command, now: float) -> Command:
    """Nothing is written: the setpoint counts as zero."""
    return replace(command, speed=0.0, written=now)


def next_command(
    register_map: RegisterMap, command: Command, limited: Limited, now: float
) -> Command:
    """The next block: one number up. The first is that of the moment, but not the echo's.

    The PLC ignores repeats; and of two gateways that begin together each knows its numbers.
    """
    if command.number is None:
        number = (command.echo or 0) + 1 + int(now * MICRO) % NUMBERS
    else:
        number = command.number + 1
    if span := register_map.modulus("command_sequence"):
        number %= int(span)
    return replace(
        command,
        number=number,
        speed=limited.speed,
        written=now,
        sent=now,
        unanswered=command.unanswered + 1,
    )


def run_mode(config: Config) -> Mode:
    """The PLC's mode of a run: in a sweep of steady speeds nobody may drive a truck."""
    return Mode.ROAD_LOAD if config.sweep is None else Mode.SPEED


def is_confirmed(config: Config, status: Status) -> bool:
    """Whether the PLC is enabled, and in the mode of the run."""
    road_load = run_mode(config) is Mode.ROAD_LOAD
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
        mode=run_mode(config) if enable else Mode.READY,
        speed_setpoint=limited.speed,
        speed_rate=limited.rate,
        ramp_limit=max(config.limits.rate_up, config.limits.rate_down),
        current_limit=config.limits.current,
        watchdog_timeout=config.limits.watchdog,
        map_version=register_map.version,
    )
