"""The PLC's inbox: it accepts a command block as a whole, or refuses it as a whole with the reason.

The map version must match. The watchdog time must be 50 to 1000 ms, so 0 does not switch it off.
The current limit must be at most 72 A. The speed setpoint is clamped later, not refused here. A
refused block changes nothing: the last accepted command stays in force.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from plant_emulator.errors import EmulatorError
from register_maps.codec import CodecError, decode_setpoint
from register_maps.register_map import RegisterMap
from register_maps.signals import Control, Mode, Setpoint

CURRENT_MAX = 72.0  # [A]
WATCHDOG_MIN, WATCHDOG_MAX, WATCHDOG_DEFAULT = 0.05, 1.0, 0.2  # [s]
# [rad/s^2] A map without a slew register gets 10 s from standstill to full speed.
SLEW_DEFAULT = 50.0
MODES = (Mode.READY, Mode.SPEED, Mode.ROAD_LOAD)
# A speed-controlled drive cannot release its shaft, so these two are refused, not ignored.
UNSUPPORTED = Control.ZERO_TORQUE | Control.COAST
# [s], [A] Neither the float32 of 0.05 nor 5 times 0.01 is exactly 0.05.
ROUNDING = 1e-6


class RefusedError(EmulatorError):
    """The PLC refuses this command block; the message is the reason."""


@dataclass(frozen=True, kw_only=True)
class Command:
    """An accepted command in SI units, with every value present.

    speed [rad/s], rate (slope of the speed) [rad/s^2], slew (limit of the slope) [rad/s^2] : motor
    current_limit [A]; watchdog [s]
    """

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


# The command in force before the gateway's first write.
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
    """Command sequence number of a block. The rest of the block is not checked."""
    register = register_map.register("command_sequence")
    assert register is not None, "a map without a command sequence is refused when it is loaded"
    return words[register.address - register_map.command.start]


def judge(register_map: RegisterMap, words: Sequence[int]) -> Command:
    """Decode and check a block. Raises RefusedError with the first violated rule."""
    try:
        command = _fill_defaults(decode_setpoint(register_map, words), register_map.version)
    except CodecError as error:
        raise RefusedError(str(error)) from error
    for violation in _violations(command, register_map.version):
        raise RefusedError(violation)
    return command


def _fill_defaults(setpoint: Setpoint, version: int) -> Command:
    """The command with a default for each register that the map lacks."""
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


def _violations(command: Command, version: int) -> list[str]:
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
    return [violation for holds, violation in rules if not holds]


class Inbox:
    """Holds the command in force, its age and the time of the gateway's last heartbeat.

    edges : control bits that rose with the command of this scan
    refusal : reason of the last refusal
    """

    def __init__(self, register_map: RegisterMap) -> None:
        self._register_map = register_map
        self.command = NO_COMMAND
        self.edges = Control(0)
        self.refusal = ""
        self._sequence: int | None = None
        self._accepted_at = self._fed_at = -inf

    def read(self, words: Sequence[int] | None, now: float) -> bool:
        """Read the block; return False if it is refused. A repeated sequence number is ignored.

        words : the block now; None before the first write
        now : PLC time [s]
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
        """Time since the last accepted command [s]."""
        return now - self._accepted_at

    def watchdog_ok(self, now: float) -> bool:
        """Whether the heartbeat changed within the gateway's own watchdog time; now [s]."""
        return now - self._fed_at <= self.command.watchdog + ROUNDING
