"""The reasons for which a run ends or cannot begin: a number and a text each.

Recordings hold the numbers, so that a number never changes its meaning.
"""

from enum import IntEnum
from typing import Final


class Reason(IntEnum):
    """Reason with its code; `text` is for the operator."""

    text: str

    def __new__(cls, code: int, text: str) -> "Reason":
        """Make a member whose value is the code."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member

    STOP_REQUESTED = 1, "stop requested"
    REMOTE_OFF = 2, "operator took the bench out of remote"
    NOT_CONFIRMED = 3, "PLC did not confirm enable and road load in time"
    NOT_CONNECTED = 10, "no connection to the PLC"
    CONNECTION_LOST = 11, "connection to the PLC lost"
    TIMEOUT = 12, "PLC did not answer in time"
    WRONG_TRANSACTION = 13, "reply to another request"
    WRONG_FUNCTION = 14, "reply with a wrong function code"
    WRONG_COUNT = 15, "reply with a wrong number of registers"
    TORN_IMAGE = 16, "sequence numbers at both ends of the block differ"
    HEARTBEAT_FROZEN = 17, "heartbeat of the PLC stands still"
    SEQUENCE_FROZEN = 18, "samples of the PLC do not advance"
    NOT_FINITE = 19, "a value is not a number"
    OUT_OF_RANGE = 20, "a value is outside the range of the register map"
    TEST_WORD = 21, "test word differs: word order or register map is wrong"
    NOT_AVAILABLE = 22, "a needed value is not available"
    STALE = 23, "no fresh sample in time"
    PLC_CLOCK = 24, "clock of the PLC stands still or differs from ours"
    TORQUE_IMPLAUSIBLE = 25, "mean torque between two samples is impossible"
    PLC_RESTARTED = 26, "PLC has restarted: its sample number or its clock jumped back"
    TARE = 27, "torque sensor shows a torque at standstill"
    PLC_NOT_READY = 30, "PLC is not ready"
    PLC_FAULT = 31, "PLC reports a fault"
    EMERGENCY_STOP = 32, "emergency stop"
    INTERLOCK = 33, "an interlock is open"
    OVERSPEED = 34, "overspeed"
    PLC_ALARM = 35, "PLC reports an alarm"
    SETPOINT_REJECTED = 36, "PLC rejects the command"
    MAP_VERSION = 37, "PLC rejects the version of the register map"
    NOT_ECHOED = 38, "PLC does not accept the commands"
    PLC_LEFT = 39, "PLC left enable or road load"
    IMPLAUSIBLE = 40, "motor and drum speed do not belong together"
    OTHER_MASTER = 41, "another master writes commands to the PLC"
    TORQUE_MODEL = 42, "shaft torque contradicts armature current and motor acceleration"
    GEAR_MODEL = 43, "motor and drum move apart by more than the backlash"
    DRUM_MODEL = 44, "drum speed changes faster than motor and truck can drive it"
    TORQUE_STUCK = 45, "torque sensor stands still while the armature current moves"
    SPEED_STUCK = 46, "one speed sensor stands still while the other moves"
    NOT_FOLLOWED = 47, "reference of the PLC does not follow the setpoint"
    MOTOR_ASTRAY = 48, "motor does not follow the reference of the PLC"
    OVERRUN = 50, "deadlines missed"
    NOT_ENCODABLE = 51, "a command does not fit into the register map"
    TOO_SLOW = 52, "PLC answers too slowly for the period"
    EXCEPTION_1 = 101, "exception 1, illegal function"
    EXCEPTION_2 = 102, "exception 2, illegal data address"
    EXCEPTION_3 = 103, "exception 3, illegal data value"
    EXCEPTION_4 = 104, "exception 4, server device failure"
    EXCEPTION_5 = 105, "exception 5, acknowledge"
    EXCEPTION_6 = 106, "exception 6, server device busy"
    EXCEPTION_7 = 107, "exception 7, negative acknowledge"
    EXCEPTION_8 = 108, "exception 8, memory parity error"
    EXCEPTION_9 = 109, "exception 9"
    EXCEPTION_10 = 110, "exception 10, gateway path unavailable"
    EXCEPTION_11 = 111, "exception 11, gateway target device failed to respond"


REASONS: Final = {int(reason): reason for reason in Reason}
"""Each reason by its code."""
BY_OPERATOR: Final = frozenset({Reason.STOP_REQUESTED, Reason.REMOTE_OFF})
"""Reasons for which an operator ends a run; any other is a trip."""
