"""The signals: what is measured, what is commanded, and the SI unit of each.

The fields of `Measurement` and `Setpoint` are the signals. A register map has the register of a
signal, and `LOG_COLUMNS` has its column in a log. The numbers of bits and states are those of the
bench's PLC.
"""

from dataclasses import MISSING, dataclass, fields
from enum import IntEnum, IntFlag
from typing import Annotated, Literal, get_args, get_type_hints


class Status(IntFlag):
    """Status bits of the PLC; a set bit means that the statement holds."""

    READY = 1 << 0
    ENABLED = 1 << 1
    REMOTE = 1 << 2
    ROAD_LOAD = 1 << 3
    AT_LIMIT = 1 << 4
    GAP = 1 << 5
    WARM = 1 << 6
    WATCHDOG_OK = 1 << 7
    EMERGENCY_STOP_OK = 1 << 8
    FAULT = 1 << 9


class PlcState(IntEnum):
    """State of the PLC."""

    INIT = 0
    READY = 1
    WARM_UP = 2
    SPEED = 3
    ROAD_LOAD = 4
    COASTDOWN = 5
    RAMP_DOWN = 6
    FAULT = 7


class Alarm(IntFlag):
    """Alarm bits of the PLC; a set bit is an alarm."""

    OVERSPEED = 1 << 0
    OVERCURRENT = 1 << 1
    OVERTORQUE = 1 << 2
    COMMUNICATION = 1 << 3
    SENSOR = 1 << 4
    DRIVE = 1 << 5
    SLIP = 1 << 6
    TEMPERATURE = 1 << 7
    SETPOINT_REJECTED = 1 << 8


class Interlock(IntFlag):
    """Interlocks of the bench; a set bit is closed, so that a broken wire reads as open."""

    RESTRAINT = 1 << 0
    GUARD = 1 << 1
    FAN = 1 << 2
    DOOR = 1 << 3
    EMERGENCY_STOP = 1 << 4
    DRIVE = 1 << 5


class Control(IntFlag):
    """Control bits of the gateway; the PLC acts on the rising edge of FAULT_RESET."""

    ENABLE = 1 << 0
    FAULT_RESET = 1 << 1
    ZERO_TORQUE = 1 << 2
    COAST = 1 << 3


class Mode(IntEnum):
    """State that the gateway asks of the PLC."""

    READY = 1
    WARM_UP = 2
    SPEED = 3
    ROAD_LOAD = 4
    COASTDOWN = 5


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """One coherent reading of the PLC in SI.

    A signal without a default is one that the gateway needs. None means that the map has no such
    register, or that the PLC reports no value.
    """

    sequence_start: Annotated[int, "1", "sample number, first word of the block; wraps"]
    plc_heartbeat: Annotated[int, "1", "scan number of the PLC's program; wraps"]
    plc_time: Annotated[float, "s", "time of the sample by the PLC's clock; wraps"]
    status: Annotated[Status, "1", "status bits"]
    plc_state: Annotated[PlcState | None, "1", "state of the PLC"] = None
    alarm: Annotated[Alarm | None, "1", "alarm bits"] = None
    alarm_reserved: Annotated[int | None, "1", "second alarm word, reserved"] = None
    motor_speed: Annotated[float, "rad/s", "motor shaft"]
    drum_speed: Annotated[float, "rad/s", "drum, from the measuring wheel"]
    shaft_torque: Annotated[float, "N m", "sensor motor-gear; negative while the motor drives"]
    shaft_torque_mean: Annotated[float | None, "N m", "its mean over the last scan"] = None
    armature_current: Annotated[float | None, "A", "armature"] = None
    armature_voltage: Annotated[float | None, "V", "armature"] = None
    speed_reference: Annotated[float | None, "rad/s", "setpoint in force after limit, ramp"] = None
    shell_temperature_1: Annotated[float | None, "K", "gearbox shell, thermocouple 1"] = None
    shell_temperature_2: Annotated[float | None, "K", "gearbox shell, thermocouple 2"] = None
    field_current: Annotated[float | None, "A", "field winding"] = None
    shaft_torque_integral: Annotated[float | None, "N m s", "integral of torque; wraps"] = None
    drum_count: Annotated[int | None, "1", "measuring wheel pulses; wraps"] = None
    motor_count: Annotated[int | None, "1", "motor encoder pulses; wraps"] = None
    command_sequence_echo: Annotated[int | None, "1", "last accepted command"] = None
    command_age: Annotated[float | None, "s", "time since the last valid command"] = None
    scan_time_max: Annotated[float | None, "s", "worst scan of the PLC"] = None
    interlock: Annotated[Interlock | None, "1", "interlock bits"] = None
    test_int16: Annotated[int | None, "1", "test constant"] = None
    test_uint32: Annotated[int | None, "1", "test constant that proves the word order"] = None
    test_float32: Annotated[float | None, "1", "test constant that proves the word order"] = None
    sequence_end: Annotated[int, "1", "sample number, last word of the block; wraps"]


@dataclass(frozen=True, kw_only=True)
class Setpoint:
    """The command block in SI. None means that the map has no such register.

    The codec replaces a `map_version` of None by that of the map, and computes a `command_crc` of
    None.
    """

    command_sequence: Annotated[int, "1", "number of this command; wraps"]
    gateway_heartbeat: Annotated[int, "1", "heartbeat of the gateway; wraps"]
    control: Annotated[Control, "1", "control bits"]
    mode: Annotated[Mode, "1", "state asked for"]
    speed_setpoint: Annotated[float, "rad/s", "motor speed asked for"]
    speed_rate: Annotated[float | None, "rad/s^2", "slope of it until the next command"] = None
    ramp_limit: Annotated[float | None, "rad/s^2", "slew limit, also of the ramp-down"] = None
    current_limit: Annotated[float | None, "A", "armature"] = None
    watchdog_timeout: Annotated[float | None, "s", "heartbeat still for longer: ramp down"] = None
    map_version: Annotated[int | None, "1", "version of the register map"] = None
    command_crc: Annotated[int | None, "1", "checksum of the words before it; 0: not used"] = None


RESERVED = "reserved"
"""Signal of a reserved register; a map may have any number of them."""


@dataclass(frozen=True, kw_only=True)
class Signal:
    """A signal: SI unit, direction, Python type, and whether the gateway needs it."""

    name: str
    unit: str
    kind: Literal["measurement", "command"]
    type: type[int] | type[float]
    needed: bool
    meaning: str


def _signals(record: type, kind: Literal["measurement", "command"]) -> dict[str, Signal]:
    hints = get_type_hints(record, include_extras=True)
    found = {}
    for field in fields(record):
        annotation, unit, meaning = get_args(hints[field.name])
        bare = [kept for kept in get_args(annotation) if kept is not type(None)] or [annotation]
        found[field.name] = Signal(
            name=field.name,
            unit=unit,
            kind=kind,
            type=bare[0],
            needed=field.default is MISSING,
            meaning=meaning,
        )
    return found


SIGNALS = _signals(Measurement, "measurement") | _signals(Setpoint, "command")


@dataclass(frozen=True, kw_only=True)
class LogColumn:
    """A column of a log.

    signal : name of the signal, without unit
    unit : unit of the column, a key of `units.UNITS` (SI everywhere but the temperature)
    measured : field of `Measurement` that a recording puts there, None: no such field
    decimals : digits after the point in a written log
    """

    column: str
    signal: str
    unit: str
    needed: bool
    measured: str | None
    decimals: int


_LOG_COLUMNS: tuple[tuple[str, str, str, bool, str | None, int], ...] = (
    ("time_s", "time", "s", True, "plc_time", 4),
    ("speed_reference_rad_s", "speed_reference", "rad/s", True, "speed_reference", 5),
    ("motor_speed_rad_s", "motor_speed", "rad/s", True, "motor_speed", 5),
    ("drum_speed_rad_s", "drum_speed", "rad/s", True, "drum_speed", 6),
    ("armature_current_A", "armature_current", "A", False, "armature_current", 5),
    ("shaft_torque_Nm", "shaft_torque", "N m", True, "shaft_torque", 5),
    ("wheel_torque_Nm", "wheel_torque", "N m", False, None, 4),
    ("armature_voltage_V", "armature_voltage", "V", False, "armature_voltage", 4),
    ("shell_temperature_degC", "shell_temperature", "degC", False, "shell_temperature_1", 2),
    ("reference_knee_time_s", "reference_knee_time", "s", False, None, 6),
    ("reference_knee_rad_s", "reference_knee", "rad/s", False, None, 5),
    ("reference_knee_2_time_s", "reference_knee_2_time", "s", False, None, 6),
    ("reference_knee_2_rad_s", "reference_knee_2", "rad/s", False, None, 5),
    ("reference_knee_3_time_s", "reference_knee_3_time", "s", False, None, 6),
    ("reference_knee_3_rad_s", "reference_knee_3", "rad/s", False, None, 5),
    ("truck_on_drum", "truck_on_drum", "1", False, None, 4),
)

LOG_COLUMNS = {
    column: LogColumn(
        column=column,
        signal=signal,
        unit=unit,
        needed=needed,
        measured=measured,
        decimals=decimals,
    )
    for column, signal, unit, needed, measured, decimals in _LOG_COLUMNS
}
