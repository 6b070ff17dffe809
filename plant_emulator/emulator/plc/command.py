"""The PLC's inbox: a command block is accepted whole, or refused whole with the reason.

The map version must match, the watchdog is 50 to 1000 ms (0 does not switch it off), the armature
current at most 72 A. The speed asked for is clamped later, not refused here. A refused block
changes nothing: the last accepted command stays in force.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from plant_emulator.errors import EmulatorError
from register_maps.codec import CodecError, decode_setpoint
from register_maps.register_map import RegisterMap
from register_maps.signals import Control, Mode, Setpoint

CURRENT_MAX = 72.0
WATCHDOG_MIN, WATCHDOG_MAX, WATCHDOG_DEFAULT = 0.05, 1.0, 0.2
# 10 s from standstill to full speed, for a map without a slew register.
SLEW_DEFAULT = 50.0
MODES = (Mode.READY, Mode.SPEED, Mode.ROAD_LOAD)
# A speed-controlled drive cannot let go of its shaft, so these two are refused, not ignored.
UNSUPPORTED = Control.ZERO_TORQUE | Control.COAST
# Seconds, amperes: a float32 of 0.05 is not 0.05, nor is 5 times 0.01.
ROUNDING = 1e-6


class RefusedError(EmulatorError):
    """The PLC does not take this command block."""


@dataclass(frozen=True, kw_only=True)
class Command:
    """An acceptable command: every value there, SI."""

    sequence: int
    heartbeat: int
    control: Control
    mode: Mode
    speed: float
    rate: float
    slew: float
    current_limit: float
    watchdog: float
    map_version: int


# What is in force before the gateway has said anything.
NO_COMMAND = Command(
    sequence=0,
    heartbeat=0,
    control=Control(0),
    mode=Mode.READY,
    speed=0.0,
    rate=0.0,
    slew=SLEW_DEFAULT,
    current_limit=CURRENT_MAX,
    watchdog=WATCHDOG_DEFAULT,
    map_version=0,
)


def sequence_of(register_map: RegisterMap, words: Sequence[int]) -> int:
    """Command sequence number of a block, read without judging the rest of it."""
    register = register_map.register("command_sequence")
    assert register is not None, "a map without a command sequence is refused when it is loaded"
    return words[register.address - register_map.command.start]


def judge(register_map: RegisterMap, words: Sequence[int]) -> Command:
    """Command of an acceptable block; raises RefusedError."""
    try:
        command = _completed(decode_setpoint(register_map, words), register_map.version)
    except CodecError as error:
        raise RefusedError(str(error)) from error
    for complaint in _complaints(command, register_map.version):
        raise RefusedError(complaint)
    return command


def _completed(setpoint: Setpoint, version: int) -> Command:
    """The command with a default for each register that the map has not."""
    return Command(
        sequence=setpoint.command_sequence,
        heartbeat=setpoint.gateway_heartbeat,
        control=setpoint.control,
        mode=setpoint.mode,
        speed=setpoint.speed_setpoint,
        rate=_or(setpoint.speed_rate, 0.0),
        slew=_or(setpoint.ramp_limit, SLEW_DEFAULT),
        current_limit=_or(setpoint.current_limit, CURRENT_MAX),
        watchdog=_or(setpoint.watchdog_timeout, WATCHDOG_DEFAULT),
        map_version=version if setpoint.map_version is None else setpoint.map_version,
    )


def _or(value: float | None, default: float) -> float:
    return default if value is None else value


def _complaints(command: Command, version: int) -> list[str]:
    rules = [
        (command.map_version == version, f"map version {command.map_version}, not {version}"),
        (command.slew > 0.0, f"ramp limit {command.slew:g} rad/s^2, must be more than 0"),
        (
            0.0 < command.current_limit <= CURRENT_MAX + ROUNDING,
            f"current limit {command.current_limit:g} A, must be more than 0, at most 72",
        ),
        (
            WATCHDOG_MIN - ROUNDING <= command.watchdog <= WATCHDOG_MAX + ROUNDING,
            f"watchdog {command.watchdog:g} s, must be 0.05 to 1",
        ),
        (command.mode in MODES, f"mode {command.mode.name} is not offered by this PLC"),
        (not command.control & UNSUPPORTED, f"{command.control!r} is not offered by this PLC"),
    ]
    return [complaint for holds, complaint in rules if not holds]


class Inbox:
    """The command in force, its age, and whether the gateway's heartbeat still moves.

    edges : control bits that rose with the command read in this scan
    refusal : why a command was refused last
    """

    def __init__(self, register_map: RegisterMap) -> None:
        self._register_map = register_map
        self.command = NO_COMMAND
        self.edges = Control(0)
        self.refusal = ""
        self._sequence: int | None = None
        self._accepted_at = self._fed_at = -inf

    def read(self, words: Sequence[int] | None, now: float) -> bool:
        """Take the block if its sequence number is new, a repeat means nothing; False: refused.

        words : the block as it now stands, None until it is first written; now: PLC time [s]
        """
        self.edges = Control(0)
        if words is None or sequence_of(self._register_map, words) == self._sequence:
            return True
        self._sequence = sequence_of(self._register_map, words)
        try:
            command = judge(self._register_map, words)
        except RefusedError as refusal:
            self.refusal = str(refusal)
            return False
        self.edges = command.control & ~self.command.control
        if command.heartbeat != self.command.heartbeat or self.command is NO_COMMAND:
            self._fed_at = now
        self._accepted_at = now
        self.command = command
        return True

    def age(self, now: float) -> float:
        """Time since a command was last accepted [s]."""
        return now - self._accepted_at

    def watchdog_ok(self, now: float) -> bool:
        """Whether the gateway's heartbeat moved within the time that it set itself."""
        return now - self._fed_at <= self.command.watchdog + ROUNDING
