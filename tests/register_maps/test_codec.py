"""Words to values and back: by round trip, and against frames that were worked out by hand."""

import math
import struct
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import register_maps
from register_maps.codec import (
    CodecError,
    command_crc,
    decode_measurement,
    decode_setpoint,
    decode_value,
    difference,
    encode_measurement,
    encode_setpoint,
    encode_value,
    scaled,
)
from register_maps.register_map import TYPES, Register
from register_maps.signals import (
    SIGNALS,
    Alarm,
    Control,
    Interlock,
    Measurement,
    Mode,
    PlcState,
    Setpoint,
    Status,
)

INT16, FLOAT32 = register_maps.load("bench_int16"), register_maps.load("bench_float32")
ORDERS = ("ABCD", "CDAB", "BADC", "DCBA")
NUMBERS = ("int16", "uint16", "int32", "uint32", "float32")

NEUTRAL = Register(
    name="REGISTER",
    signal="shaft_torque_mean",
    table="holding",
    address=0,
    type="float32",
    word_order="ABCD",
    scale=1.0,
    offset=0.0,
    unit="N m",
    range=(-3.4e38, 3.4e38),
    access="read",
    description="",
    source="",
)


def a_register(type_name, **changes):
    """A register over the whole range of its type, with what the test changes."""
    register = replace(NEUTRAL, type=type_name, **changes)
    ends = sorted(
        raw * register.scale + register.offset for raw in (register.raw.low, register.raw.high)
    )
    return replace(register, range=tuple(ends)) if "range" not in changes else register


def holding(register_map, signal):
    found = register_map.register(signal)
    assert found is not None
    return found


# ---- worked out by hand ----------------------------------------------------------------------

# 123.456 = 1.929 * 2^6: sign 0, exponent 6 + 127 = 133 = 0x85, fraction 0.929 * 2^23 = 0x76E979
#   0 10000101 11101101110100101111001 = 42 F6 E9 79
# 0x12345678 = 305 419 896. -12345 = 65536 - 12345 = 53191 = 0xCFC7.
# -2 as int32 = FF FF FF FE. -1.5 = -1.1b: sign 1, exponent 127: BF C0 00 00.
BY_HAND = [
    ("float32", "ABCD", (0x42F6, 0xE979), 123.456),
    ("float32", "CDAB", (0xE979, 0x42F6), 123.456),
    ("float32", "BADC", (0xF642, 0x79E9), 123.456),
    ("float32", "DCBA", (0x79E9, 0xF642), 123.456),
    ("float32", "CDAB", (0x0000, 0xBFC0), -1.5),
    ("uint32", "ABCD", (0x1234, 0x5678), 305419896),
    ("uint32", "CDAB", (0x5678, 0x1234), 305419896),
    ("uint32", "BADC", (0x3412, 0x7856), 305419896),
    ("uint32", "DCBA", (0x7856, 0x3412), 305419896),
    ("int32", "ABCD", (0xFFFF, 0xFFFE), -2),
    ("int32", "CDAB", (0xFFFE, 0xFFFF), -2),
    ("int32", "DCBA", (0xFEFF, 0xFFFF), -2),
    ("int16", "ABCD", (0xCFC7,), -12345),
    ("int16", "CDAB", (0xCFC7,), -12345),
    ("int16", "BADC", (0xC7CF,), -12345),
    ("int16", "DCBA", (0xC7CF,), -12345),
    ("uint16", "ABCD", (0xCFC7,), 53191),
]


@pytest.mark.parametrize(("type_name", "order", "words", "value"), BY_HAND)
def test_frames_worked_out_by_hand(type_name, order, words, value):
    register = a_register(type_name, word_order=order)
    assert decode_value(register, words) == pytest.approx(value, rel=1e-7)
    assert encode_value(register, value) == words


# The whole int16 block, word by word, written by hand.
INT16_FRAME = (
    0x0007,  # 0 SEQ_A 7
    0x0101,  # 1 HB_PLC 257
    *(0x0001, 0x86A0),  # 2-3 T_PLC 100000 * 0.1 ms = 10 s
    0x018D,  # 4 STATUS bits 0, 2, 3, 7, 8
    0x0004,  # 5 STATE road-load
    0x0010,  # 6 ALARM1 bit 4
    0x0000,  # 7 ALARM2
    0x4650,  # 8 MOT_SPEED 18000 * 0.2 = 3600 rpm = 120 pi rad/s
    0x2EE0,  # 9 DRUM_SPEED 12000 * 0.0005 = 6 rad/s
    0xFB00,  # 10 TMEAS -1280 * 0.01 = -12.8 N m
    0xFB01,  # 11 TMEAS_AVG -12.79 N m
    0x0640,  # 12 ARM_CURR 16 A
    0x0DAC,  # 13 ARM_VOLT 350 V
    0x4651,  # 14 REF_ECHO 3600.2 rpm
    0x0140,  # 15 SHELL_T1 32.0 degC
    0x8000,  # 16 SHELL_T2 not available
    0x07D0,  # 17 FIELD_CURR 2 A
    *(0xFFFE, 0x7960),  # 18-19 TQ_IMPULSE -100000 * 0.0001 = -10 N m s
    *(0x0000, 0x0010),  # 20-21 DRUM_COUNT 16
    *(0x0001, 0x0000),  # 22-23 MOT_COUNT 65536
    0x0029,  # 24 CMD_SEQ_ECHO 41
    0x0014,  # 25 CMD_AGE 20 ms
    0x006E,  # 26 SCAN_MAX 11 ms
    0x003F,  # 27 INTERLOCK all closed
    0xCFC7,  # 28 TEST_I16 -12345
    *(0x1234, 0x5678),  # 29-30 TEST_U32
    0x0007,  # 31 SEQ_B 7
)
# The same moment in the float32 block.
FLOAT32_FRAME = (
    *(0x0007, 0x0101),  # 100 SEQ_A, 101 HB_PLC
    *(0x0098, 0x9680),  # 102-103 T_PLC 10 000 000 us
    *(0x018D, 0x0004, 0x0010, 0x0000),  # 104-107 STATUS, STATE, ALARM1, ALARM2
    *(0x43BC, 0x7EDD),  # 108 motor 376.99112 = 1.47262156 * 2^8 rad/s
    *(0x40C0, 0x0000),  # 110 drum 6 = 1.5 * 2^2 rad/s
    *(0xC14C, 0xCCCD),  # 112 -12.8 = -1.6 * 2^3 N m
    *(0xC148, 0x0000),  # 114 -12.5 = -1.5625 * 2^3 N m
    *(0x4180, 0x0000),  # 116 16 A
    *(0x43AF, 0x0000),  # 118 350 = 1.3671875 * 2^8 V
    *(0x43BC, 0x8000),  # 120 377 = 1.47265625 * 2^8 rad/s
    *(0x4200, 0x0000),  # 122 32 degC
    *(0x4204, 0x0000),  # 124 33 = 1.03125 * 2^5 degC
    *(0x4000, 0x0000),  # 126 2 A
    *(0xFFFE, 0x7960),  # 128 TQ_IMPULSE -10 N m s
    *(0x0000, 0x0010),  # 130 DRUM_COUNT
    *(0x0001, 0x0000),  # 132 MOT_COUNT
    *(0x0029, 0x0014, 0x006E, 0x003F),  # 134-137 echo, age, scan, interlock
    *(0x42F6, 0xE979),  # 138 TEST_F32 123.456
    0x0007,  # 140 SEQ_B
)
MOMENT = Measurement(
    sequence_start=7,
    plc_heartbeat=257,
    plc_time=10.0,
    status=Status.READY
    | Status.REMOTE
    | Status.ROAD_LOAD
    | Status.WATCHDOG_OK
    | Status.EMERGENCY_STOP_OK,
    plc_state=PlcState.ROAD_LOAD,
    alarm=Alarm.SENSOR,
    alarm_reserved=0,
    motor_speed=120.0 * math.pi,
    drum_speed=6.0,
    shaft_torque=-12.8,
    shaft_torque_mean=-12.79,
    armature_current=16.0,
    armature_voltage=350.0,
    speed_reference=3600.2 * math.pi / 30.0,
    shell_temperature_1=305.15,
    shell_temperature_2=None,
    field_current=2.0,
    shaft_torque_integral=-10.0,
    drum_count=16,
    motor_count=65536,
    command_sequence_echo=41,
    command_age=0.020,
    scan_time_max=0.011,
    interlock=Interlock(0b111111),
    test_int16=-12345,
    test_uint32=0x12345678,
    sequence_end=7,
)


def alike(left, right):
    """Field by field, to the last digits that a conversion may cost."""
    for name, value in vars(left).items():
        close = pytest.approx(value, rel=1e-6) if isinstance(value, float) else value
        assert getattr(right, name) == close, name


def test_int16_block_worked_out_by_hand():
    alike(decode_measurement(INT16, INT16_FRAME), MOMENT)
    assert encode_measurement(INT16, MOMENT) == INT16_FRAME


def test_float32_block_worked_out_by_hand():
    moment = replace(
        MOMENT,
        shaft_torque_mean=-12.5,
        speed_reference=377.0,
        shell_temperature_2=306.15,
        test_int16=None,
        test_uint32=None,
        test_float32=123.456,
    )
    alike(decode_measurement(FLOAT32, FLOAT32_FRAME), moment)
    assert encode_measurement(FLOAT32, moment) == FLOAT32_FRAME


def test_flags_and_states_come_out_as_flags_and_states():
    seen = decode_measurement(INT16, INT16_FRAME)
    assert isinstance(seen.status, Status)
    assert Status.REMOTE in seen.status
    assert Status.FAULT not in seen.status
    assert seen.plc_state is PlcState.ROAD_LOAD
    assert decode_value(holding(INT16, "alarm"), (0x8000,)) == 0x8000, "an unknown bit is kept"


SETPOINT = Setpoint(
    command_sequence=42,
    gateway_heartbeat=65535,
    control=Control.ENABLE,
    mode=Mode.ROAD_LOAD,
    speed_setpoint=120.0 * math.pi,
    speed_rate=-10.0 * math.pi,
    ramp_limit=20.0 * math.pi,
    current_limit=72.0,
    watchdog_timeout=0.2,
)
INT16_COMMAND = (
    0x002A,  # 64 CMD_SEQ 42
    0xFFFF,  # 65 HB_GW
    0x0001,  # 66 CTRL enable
    0x0004,  # 67 MODE road-load
    0x4650,  # 68 SPEED_REF 3600 rpm / 0.2
    0xFED4,  # 69 SPEED_RATE -300 rpm/s
    0x0258,  # 70 RAMP_LIMIT 600 rpm/s
    0x1C20,  # 71 CURR_LIMIT 7200
    0x00C8,  # 72 WD_TIMEOUT 200 ms
    0x0001,  # 73 MAP_VERSION
)


def test_command_block_worked_out_by_hand():
    words = encode_setpoint(INT16, SETPOINT)
    assert words[:10] == INT16_COMMAND
    assert words[12:] == (0, 0, 0, 0)
    alike(
        decode_setpoint(INT16, words),
        replace(SETPOINT, map_version=1, command_crc=words[10] * 65536 + words[11]),
    )


def test_command_checksum_is_the_crc_of_the_standard():
    assert command_crc([0x3132, 0x3334]) == 0x9BE3E0A3  # "1234": the trailer that gzip writes
    words = encode_setpoint(INT16, SETPOINT)
    assert words[10] * 65536 + words[11] == command_crc(INT16_COMMAND)


def test_a_wrong_checksum_is_refused_and_none_is_accepted():
    words = encode_setpoint(INT16, SETPOINT)
    with pytest.raises(CodecError) as refused:
        decode_setpoint(INT16, (43, *words[1:]))
    assert refused.value.kind == "checksum"
    unsigned = encode_setpoint(INT16, replace(SETPOINT, command_crc=0))
    assert decode_setpoint(INT16, unsigned).command_crc == 0


def test_float32_command_block_has_no_checksum_and_ends_in_reserved_zeros():
    words = encode_setpoint(FLOAT32, SETPOINT)
    assert words[12:14] == (200, 1)
    assert words[14:] == (0,) * 18
    assert decode_setpoint(FLOAT32, words).command_crc is None


def test_another_map_version_reaches_the_plc_as_it_was_sent():
    words = encode_setpoint(INT16, replace(SETPOINT, map_version=9))
    assert decode_setpoint(INT16, words).map_version == 9


# ---- round trips -----------------------------------------------------------------------------

scales = st.sampled_from((1.0, -1.0, 0.2, 0.1, 0.0005, 1e-4, 12.5))
offsets = st.sampled_from((0.0, -40.0, 273.15, 1e3))


@given(data=st.data(), order=st.sampled_from(ORDERS), scale=scales, offset=offsets)
@pytest.mark.parametrize("type_name", NUMBERS)
def test_encode_inverts_decode(type_name, data, order, scale, offset):
    register = a_register(type_name, word_order=order, scale=scale, offset=offset)
    size = register.raw.words
    words = tuple(data.draw(st.lists(st.integers(0, 0xFFFF), min_size=size, max_size=size)))
    try:
        value = decode_value(register, words)
    except CodecError:
        assert type_name == "float32"
        return
    if type_name != "float32":
        assert encode_value(register, value) == words
    elif offset == 0.0 and value != 0.0:
        assert decode_value(register, encode_value(register, value)) == pytest.approx(value)


@given(data=st.data(), order=st.sampled_from(ORDERS), scale=scales, offset=offsets)
@pytest.mark.parametrize("type_name", NUMBERS)
def test_decode_inverts_encode_to_half_a_digit(type_name, data, order, scale, offset):
    register = a_register(type_name, word_order=order, scale=scale, offset=offset)
    top = 1e6 if type_name == "float32" else register.raw.high
    raw = data.draw(st.floats(max(register.raw.low, -top), top))
    value = raw * scale + offset
    seen = decode_value(register, encode_value(register, value))
    digit = abs(raw) * 2.0**-23 if type_name == "float32" else 1.0
    assert seen == pytest.approx(value, abs=(0.5 * digit + 1e-5) * abs(scale) + 1e-9)


@given(word=st.integers(0, 0xFFFF), order=st.sampled_from(ORDERS))
def test_bits_come_back_as_they_were(word, order):
    register = a_register("bits", signal="status", unit="1", word_order=order)
    flags = decode_value(register, (word,))
    assert isinstance(flags, Status)
    assert encode_value(register, flags) == (word,)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("state", list(Mode))
def test_states_come_back_as_they_were(state, order):
    register = a_register("enum", signal="mode", unit="1", word_order=order)
    words = encode_value(register, state)
    assert words == ((state.value,) if order in ("ABCD", "CDAB") else (state.value << 8,))
    assert decode_value(register, words) is state


@pytest.mark.parametrize(
    ("unit", "reading", "si"),
    [
        ("rpm", 4830.0, 505.796417),  # 4830 * 2 pi / 60
        ("rpm/s", 60.0, 6.28318531),
        ("degC", 20.0, 293.15),
        ("K", 20.0, 20.0),
        ("ms", 250.0, 0.25),
        ("us", 250.0, 0.00025),
        ("s", 2.5, 2.5),
        ("mA", 250.0, 0.25),
        ("count", 3.0, 3.0),
        ("rad/s", 3.0, 3.0),
        ("rad/s^2", 3.0, 3.0),
        ("N m", 3.0, 3.0),
        ("N m s", 3.0, 3.0),
        ("A", 3.0, 3.0),
        ("V", 3.0, 3.0),
        ("1", 3.0, 3.0),
    ],
)
def test_a_unit_becomes_si_and_back(unit, reading, si):
    register = a_register("float32", unit=unit)
    raw = struct.unpack(">2H", struct.pack(">f", reading))
    assert decode_value(register, raw) == pytest.approx(si, rel=1e-8)
    assert scaled(register, si) == pytest.approx(reading, rel=1e-8)


# ---- rounding and refusals -------------------------------------------------------------------


@pytest.mark.parametrize(("value", "raw"), [(0.5, 0), (1.5, 2), (2.5, 2), (2.6, 3), (2.4, 2)])
def test_the_nearest_raw_value_is_sent_and_a_tie_goes_to_the_even_one(value, raw):
    assert encode_value(a_register("int16"), value) == (raw,)
    assert encode_value(a_register("int16"), -value) == (-raw % 65536,)


@pytest.mark.parametrize(
    ("type_name", "value"),
    [
        ("int16", 32767.6),
        ("int16", -32769.0),
        ("uint16", -1.0),
        ("uint16", 65536.0),
        ("int32", 2.0**31),
        ("uint32", 2.0**32),
        ("uint32", -0.6),
        ("float32", 3.5e38),
        ("int16", 1e300),
    ],
)
def test_value_out_of_range_is_refused_not_wrapped(type_name, value):
    with pytest.raises(CodecError) as refused:
        encode_value(a_register(type_name), value)
    assert refused.value.kind == "range"


def test_the_map_range_binds_the_gateway_on_its_last_digit():
    speed = holding(INT16, "speed_setpoint")
    rpm = math.pi / 30.0
    assert encode_value(speed, 4830.0 * rpm) == (24150,)
    assert encode_value(speed, 4830.09 * rpm) == (24150,), "rounds to the last allowed digit"
    for value in (4830.2 * rpm, -0.2 * rpm):
        with pytest.raises(CodecError, match=r"SPEED_REF: range: .* allowed 0 \.\. 4830 rpm"):
            encode_setpoint(INT16, replace(SETPOINT, speed_setpoint=value))


def test_the_map_range_does_not_bind_the_plc():
    words = list(encode_setpoint(INT16, replace(SETPOINT, command_crc=0)))
    words[4] = 30000  # 6000 rpm, written by another client
    assert decode_setpoint(INT16, words).speed_setpoint == pytest.approx(200.0 * math.pi)
    hot = encode_measurement(INT16, replace(MOMENT, shell_temperature_1=273.15 + 400.0))
    assert hot[15] == 4000
    with pytest.raises(
        CodecError, match=r"SHELL_T1: range: 0x0FA0 = 400 degC, allowed -60 \.\. 300"
    ):
        decode_measurement(INT16, hot)
    with pytest.raises(CodecError):
        encode_measurement(INT16, replace(MOMENT, shell_temperature_1=273.15 + 4000.0))


NOT_NUMBERS = [(0x7FC0, 0), (0xFFC0, 1), (0x7F80, 1), (0x7F80, 0), (0xFF80, 0)]
SUBNORMAL = [(0x0000, 1), (0x007F, 0xFFFF), (0x8000, 1)]


@pytest.mark.parametrize("words", NOT_NUMBERS + SUBNORMAL)
def test_a_float_that_is_no_measurement_is_refused(words):
    frame = (*FLOAT32_FRAME[:12], *words, *FLOAT32_FRAME[14:])
    with pytest.raises(CodecError) as refused:
        decode_measurement(FLOAT32, frame)
    assert (refused.value.register, refused.value.kind) == ("TMEAS", "not finite")
    command = encode_setpoint(FLOAT32, SETPOINT)
    with pytest.raises(CodecError) as refused:
        decode_setpoint(FLOAT32, (*command[:4], *words, *command[6:]))
    assert (refused.value.register, refused.value.kind) == ("SPEED_REF", "not finite")


@pytest.mark.parametrize("words", [(0, 0), (0x8000, 0), (0x0080, 0), (0x8080, 0)])
def test_zero_and_the_smallest_normal_floats_are_numbers(words):
    assert abs(decode_value(a_register("float32"), words)) in (0.0, 2.0**-126)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("register_map", [INT16, FLOAT32])
def test_a_setpoint_that_is_not_finite_is_never_sent(register_map, value):
    with pytest.raises(CodecError) as refused:
        encode_setpoint(register_map, replace(SETPOINT, speed_setpoint=value))
    assert refused.value.kind == "not finite"


@given(value=st.floats(-(2.0**-126), 2.0**-126, exclude_min=True, exclude_max=True))
def test_no_subnormal_float_is_ever_sent(value):
    assert encode_value(a_register("float32"), value) in [(0, 0), (0x0080, 0), (0x8080, 0)]


def test_not_available_is_none_where_one_can_do_without_and_refused_where_not():
    lost = [*INT16_FRAME]
    lost[12] = 0x8000
    assert decode_measurement(INT16, lost).armature_current is None
    lost[8] = 0x8000
    with pytest.raises(CodecError) as refused:
        decode_measurement(INT16, lost)
    assert (refused.value.register, refused.value.kind) == ("MOT_SPEED", "not available")
    assert refused.value.raw == (0x8000,)


def test_no_value_for_a_register_without_such_a_pattern_is_refused():
    with pytest.raises(CodecError, match="SHELL_T2: not available"):
        encode_measurement(FLOAT32, MOMENT)
    with pytest.raises(CodecError, match="RAMP_LIMIT: not available"):
        encode_setpoint(INT16, replace(SETPOINT, ramp_limit=None))


def test_a_state_that_there_is_not_is_refused():
    frame = [*INT16_FRAME]
    frame[5] = 8
    with pytest.raises(CodecError, match=r"STATE: range: 0x0008 .* 4 ROAD_LOAD"):
        decode_measurement(INT16, frame)
    command = [*encode_setpoint(INT16, replace(SETPOINT, command_crc=0))]
    command[3] = 0
    with pytest.raises(CodecError, match="MODE: not a state: 0x0000"):
        decode_setpoint(INT16, command)


@pytest.mark.parametrize("place", [28, 29, 30])
def test_a_wrong_test_constant_is_refused(place):
    frame = [*INT16_FRAME]
    frame[place] ^= 0x0100
    with pytest.raises(CodecError) as refused:
        decode_measurement(INT16, frame)
    assert refused.value.kind == "constant"


@pytest.mark.parametrize(
    ("register_map", "frame"), [(INT16, INT16_FRAME), (FLOAT32, FLOAT32_FRAME)]
)
@pytest.mark.parametrize("order", ORDERS[1:])
def test_another_word_order_is_noticed(register_map, frame, order):
    registers = tuple(replace(found, word_order=order) for found in register_map.registers)
    mistaken = replace(register_map, registers=registers)
    with pytest.raises(CodecError):
        decode_measurement(mistaken, frame)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize(
    ("register_map", "frame"), [(INT16, INT16_FRAME), (FLOAT32, FLOAT32_FRAME)]
)
def test_a_whole_block_in_any_order_says_the_same(register_map, frame, order):
    registers = tuple(replace(found, word_order=order) for found in register_map.registers)
    other = replace(register_map, registers=registers)
    seen = decode_measurement(register_map, frame)
    assert decode_measurement(other, encode_measurement(other, seen)) == seen
    command = decode_setpoint(other, encode_setpoint(other, SETPOINT))
    plain = decode_setpoint(register_map, encode_setpoint(register_map, SETPOINT))
    assert replace(command, command_crc=None) == replace(plain, command_crc=None)


@pytest.mark.parametrize("words", [(), (0,) * 31, (0,) * 33, (0,) * 31 + (65536,), (0.5,) * 32])
def test_words_that_are_none_or_too_few_or_too_many_are_refused(words):
    with pytest.raises(CodecError) as refused:
        decode_measurement(INT16, words)
    assert refused.value.kind == "words"


@given(words=st.lists(st.integers(0, 0xFFFF), min_size=16, max_size=41), plausible=st.booleans())
@pytest.mark.parametrize("register_map", [INT16, FLOAT32])
@pytest.mark.parametrize("decode", [decode_measurement, decode_setpoint])
def test_decoder_raises_nothing_but_its_own_error(register_map, decode, words, plausible):
    whole = {id(INT16): INT16_FRAME, id(FLOAT32): FLOAT32_FRAME}[id(register_map)]
    frame = (*words, *whole[len(words) :]) if plausible else words
    try:
        seen = decode(register_map, frame)
    except CodecError:
        return
    for value in vars(seen).values():
        assert value is None or math.isfinite(value)


@given(words=st.lists(st.integers(0, 0xFFFF), min_size=32, max_size=32))
def test_what_the_decoder_accepts_lies_inside_the_map_range(words):
    try:
        seen = decode_measurement(INT16, words[:28] + list(INT16_FRAME[28:31]) + words[31:])
    except CodecError:
        return
    for register in INT16.registers:
        value = vars(seen).get(register.signal)
        if value is not None:
            low, high = register.range
            assert low - 1e-6 <= scaled(register, value) <= high + 1e-6


# ---- counters --------------------------------------------------------------------------------


def test_a_counter_may_be_given_unwrapped():
    later = replace(
        MOMENT, plc_time=10.0 + 2**32 * 1e-4, shaft_torque_integral=-10.0 - 2**32 * 1e-4
    )
    words = encode_measurement(INT16, replace(later, plc_heartbeat=257 + 3 * 65536))
    assert words == INT16_FRAME


def test_modulus_is_the_span_of_the_counter():
    assert INT16.modulus("plc_time") == pytest.approx(429496.7296)
    assert INT16.modulus("shaft_torque_integral") == pytest.approx(429496.7296)
    assert FLOAT32.modulus("plc_time") == pytest.approx(4294.967296)
    assert INT16.modulus("sequence_start") == 65536
    assert INT16.modulus("motor_speed") is None
    assert INT16.modulus("test_float32") is None


@given(before=st.integers(0, 65535), step=st.integers(-32767, 32767))
def test_difference_is_right_across_the_wrap(before, step):
    assert difference((before + step) % 65536, before, 65536.0) == step


def test_a_clock_may_start_again_at_midnight(tmp_path):
    """864 000 000 digits of 0.1 ms are a day; the first after midnight is 0."""
    text = Path(register_maps.__file__).with_name("bench_int16.toml").read_text()
    daily = tmp_path / "daily.toml"
    daily.write_text(text.replace("range = [0, 429496729.5]", "range = [0, 86399999.9]"))
    found = register_maps.load(daily)
    modulus = found.modulus("plc_time")
    assert modulus == pytest.approx(86400.0, abs=1e-9)
    assert difference(0.004, 86399.994, modulus) == pytest.approx(0.010, abs=1e-9)
    clock = found.register("plc_time")
    assert encode_value(clock, 86399.9999) == (13183, 38911)  # 0x337F97FF
    assert encode_value(clock, 86400.0) == (0, 0)
    with pytest.raises(CodecError, match="range"):
        decode_value(clock, (13183, 38912))


def test_difference_of_plc_time_across_the_wrap():
    modulus = INT16.modulus("plc_time")
    assert difference(0.005, 429496.7246, modulus) == pytest.approx(0.010, abs=1e-9)
    assert difference(3.0, 1.0, None) == 2.0


# ---- the language ----------------------------------------------------------------------------


def test_every_type_has_the_size_of_the_specification():
    sizes = {name: (raw.words, struct.calcsize(">" + raw.code)) for name, raw in TYPES.items()}
    assert all(size == 2 * words for words, size in sizes.values())
    assert [sizes[name][0] for name in NUMBERS] == [1, 1, 2, 2, 2]


def test_signals_are_the_fields_of_the_two_records():
    assert set(SIGNALS) == set(vars(MOMENT)) | set(vars(SETPOINT))
    assert SIGNALS["status"].type is Status
    assert not SIGNALS["interlock"].needed
    assert SIGNALS["interlock"].type is Interlock
