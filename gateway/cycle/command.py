"""The command block: its number, its bits, its arrival, and its acceptance by the PLC.

Writing begins in ARMED with enable off, because the PLC starts on the rising edge of enable.
Writing continues in SAFE, because a lost last command would leave the command before it in force.

Enable is on from the start of a run, and only while each tick sees that the PLC is in this run. A
PLC that has restarted takes any enable for a rising edge. So a tick of a run that has no reading
writes nothing, and a ramp-down without a reading goes on with enable off. Enable that was once off
stays off until the next start.
"""

from dataclasses import dataclass, replace
from math import inf

from gateway.configuration.config import Config
from gateway.cycle.limits import Limited
from gateway.cycle.samples import LINK_IS_DOWN
from gateway.cycle.supervisor import State, Supervisor
from gateway.reasons import Reason
from register_maps.register_map import RegisterMap
from register_maps.signals import Control, Measurement, Mode, Setpoint, Status

WRITING = frozenset({State.ARMED, State.RUN, State.RAMPDOWN, State.SAFE})
NOT_BY_WAITING = LINK_IS_DOWN | {Reason.NOT_ENCODABLE}
"""Faults that the next write will meet again."""
RECENT, ARRIVAL_JITTER = 0.25, 0.1
"""[s] Greatest age of a command that some master still writes; the slowest gateway writes every 0.2
s. The second number is the time in which a PLC takes up a block that has arrived."""
MICRO, NUMBERS = 1e6, 30011
"""Parts of a second, and the count of possible first numbers. The count is a prime, so that two
gateways with periodic starts still get different numbers."""


@dataclass(frozen=True, kw_only=True)
class Command:
    """The last command block, and what the PLC has echoed. Times are those of our clock [s].

    number : number of the last block, None: no block has been written
    speed, written : last setpoint [rad/s] and its time; a tick without a block counts as setpoint 0
    sent : time of the tick that made the last block
    ticked, heard : times of the last tick, and of the last tick with a good reading
    asked, arrived : before that reading was asked for; after the last block has arrived
    enabled : enable of the last block
    unanswered : count of blocks after the block that was echoed last
    echo, echo_moved : the last echo, and the time of its last change or of the start of the run
    other_wrote : time at which the PLC last accepted a block of another master
    got_through : time of the last block that has certainly arrived
    fault : of the first write that failed after `got_through`
    down : the last write failed in a way that waiting does not cure
    """

    number: int | None = None
    speed: float = 0.0
    written: float = 0.0
    sent: float = -inf
    ticked: float = -inf
    heard: float = -inf
    asked: float = -inf
    arrived: float = -inf
    enabled: bool = False
    unanswered: int = 0
    echo: int | None = None
    echo_moved: float = -inf
    other_wrote: float = -inf
    got_through: float = -inf
    fault: Reason | None = None
    down: bool = False


def note_tick(command: Command, now: float, latency: float) -> Command:
    """Note a tick, and when the tick before read and wrote; `latency` is that of the tick before.

    A computer under load may stop a tick between its reading, its time and its write. The tick
    began no earlier than its latency before its time, and ended no later than that after it.
    """
    before = command.ticked
    return replace(
        command,
        ticked=now,
        asked=before - latency if command.heard == before else command.asked,
        arrived=before + latency if command.sent == before else command.arrived,
    )


def note_echo(
    register_map: RegisterMap, command: Command, sample: Measurement | None, now: float
) -> Command:
    """Note which command the PLC accepted up to a new sample, and whether this gateway sent it."""
    if sample is None:
        return command
    if _other_master_wrote(command, sample.command_age):
        command = replace(command, other_wrote=now)
    echo, before = sample.command_sequence_echo, command.echo
    if echo is None or echo == before:
        return command
    moved = replace(command, echo=echo, echo_moved=now)
    since = _blocks_since(register_map, command, echo)
    if since is not None:
        return replace(moved, unanswered=since)
    return moved if before is None else replace(moved, other_wrote=now)


def _other_master_wrote(command: Command, age: float | None) -> bool:
    """Whether the PLC accepted a command after our last one; `age` is that of its command [s].

    The PLC took a new sample after the reading before it was asked for: that reading lacks it.
    """
    return (
        age is not None and age < RECENT and command.asked - command.arrived > age + ARRIVAL_JITTER
    )


def _blocks_since(register_map: RegisterMap, command: Command, echo: int) -> int | None:
    """Count of our blocks after the block with this echo; None: that block is not ours."""
    if command.number is None:
        return None
    since = command.number - echo
    if span := register_map.modulus("command_sequence"):
        since %= int(span)
    return since if since in range(command.unanswered) else None


def note_reply(command: Command, measurement: Measurement | None, fault: Reason | None) -> Command:
    """Note what became of the last block. A fault beside a good reading is a fault of the write.

    Without a reading, the fault belongs to the reading and says nothing about the write before it.
    A block whose write failed may have arrived at any time before this reading.
    """
    if measurement is None:
        return command
    if measurement.sequence_start == measurement.sequence_end:
        command = replace(command, heard=command.ticked)
    if fault is None:
        return replace(command, got_through=command.written, fault=None, down=False)
    first, down = command.fault or fault, fault in NOT_BY_WAITING
    return replace(command, arrived=command.ticked, fault=first, down=down)


def fault(command: Command, now: float, stale: float) -> Reason | None:
    """Fault that has kept every block from arriving for too long; None: blocks arrive."""
    late = now - command.got_through > stale
    return command.fault if command.down or late else None


def reset(command: Command, now: float) -> Command:
    """Note that this state writes nothing, so that the setpoint counts as zero."""
    return replace(command, speed=0.0, written=now, enabled=False)


def stays_enabled(
    config: Config, command: Command, supervisor: Supervisor, seen: Measurement | None
) -> bool:
    """Whether this tick may write enable; `seen` is the reading of this tick, None: no reading.

    The start of a run writes it until the PLC has confirmed. From then on the PLC has to show, in
    every tick, that it is still in this run.
    """
    if supervisor.state is State.RUN and not supervisor.confirmed:
        return True
    if supervisor.state not in (State.RUN, State.RAMPDOWN) or seen is None:
        return False
    return command.enabled and is_confirmed(config, seen.status)


def next_command(
    register_map: RegisterMap, command: Command, limited: Limited, now: float, *, enable: bool
) -> Command:
    """Return the next command, one number up. The first number follows from the time and the echo.

    The PLC ignores a repeated number. Two gateways that start together get different numbers, so
    that each knows its own.
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
        enabled=enable,
        unanswered=command.unanswered + 1,
    )


def run_mode(config: Config) -> Mode:
    """Mode of the PLC for a run: road load; for a program without a truck: speed."""
    return Mode.ROAD_LOAD if config.program is None else Mode.SPEED


def is_confirmed(config: Config, status: Status) -> bool:
    """Whether the PLC is enabled and in the mode of the run."""
    road_load = run_mode(config) is Mode.ROAD_LOAD
    return Status.ENABLED in status and (Status.ROAD_LOAD in status) is road_load


def block(
    config: Config, register_map: RegisterMap, command: Command, limited: Limited
) -> Setpoint:
    """Command block of a command and its limited setpoint, in SI.

    A PLC without enable ramps down by itself, at the slope of the ramp-down.
    """
    number, enable = command.number or 0, command.enabled
    down, up = config.limits.rate_down, config.limits.rate_up
    return Setpoint(
        command_sequence=number,
        gateway_heartbeat=number,
        control=Control.ENABLE if enable else Control(0),
        mode=run_mode(config) if enable else Mode.READY,
        speed_setpoint=limited.speed,
        speed_rate=limited.rate,
        ramp_limit=max(up, down) if enable else down,
        current_limit=config.limits.current,
        watchdog_timeout=config.limits.watchdog,
        map_version=register_map.version,
    )
