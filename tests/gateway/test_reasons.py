"""A reason's number is what recordings hold: it may never come to mean another thing."""

from gateway.reasons import Reason

CODES = {
    "STOP_REQUESTED": 1,
    "REMOTE_OFF": 2,
    "NOT_CONFIRMED": 3,
    "NOT_CONNECTED": 10,
    "CONNECTION_LOST": 11,
    "TIMEOUT": 12,
    "WRONG_TRANSACTION": 13,
    "WRONG_FUNCTION": 14,
    "WRONG_COUNT": 15,
    "TORN_IMAGE": 16,
    "HEARTBEAT_FROZEN": 17,
    "SEQUENCE_FROZEN": 18,
    "NOT_FINITE": 19,
    "OUT_OF_RANGE": 20,
    "TEST_WORD": 21,
    "NOT_AVAILABLE": 22,
    "STALE": 23,
    "PLC_CLOCK": 24,
    "TORQUE_IMPLAUSIBLE": 25,
    "PLC_RESTARTED": 26,
    "TARE": 27,
    "PLC_NOT_READY": 30,
    "PLC_FAULT": 31,
    "EMERGENCY_STOP": 32,
    "INTERLOCK": 33,
    "OVERSPEED": 34,
    "PLC_ALARM": 35,
    "SETPOINT_REJECTED": 36,
    "MAP_VERSION": 37,
    "NOT_ECHOED": 38,
    "PLC_LEFT": 39,
    "IMPLAUSIBLE": 40,
    "OTHER_MASTER": 41,
    "TORQUE_MODEL": 42,
    "GEAR_MODEL": 43,
    "DRUM_MODEL": 44,
    "TORQUE_STUCK": 45,
    "SPEED_STUCK": 46,
    "NOT_FOLLOWED": 47,
    "MOTOR_ASTRAY": 48,
    "OVERRUN": 50,
    "NOT_ENCODABLE": 51,
    "TOO_SLOW": 52,
} | {f"EXCEPTION_{code}": 100 + code for code in range(1, 12)}


def test_numbers_never_change():
    assert {reason.name: reason.value for reason in Reason} == CODES


def test_every_reason_has_a_text_of_its_own():
    assert len({reason.text for reason in Reason}) == len(Reason)
    assert all(reason.text for reason in Reason)
