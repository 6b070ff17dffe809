"""Every shipped map: it loads, it fits two requests, and it says what the bench's list says."""

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest

import register_maps
from register_maps.codec import CodecError, decode_value, encode_value
from register_maps.signals import LOG_COLUMNS, SIGNALS
from register_maps.units import UNITS

FOLDER = Path(register_maps.__file__).parent
MAPS = sorted(path.stem for path in FOLDER.glob("*.toml"))

# Address, name, type, value of one digit, unit: typed by hand.
INT16_LIST = """
0 SEQ_A uint16 1 count
1 HB_PLC uint16 1 count
2 T_PLC uint32 0.1 ms
4 STATUS bits 1 1
5 STATE enum 1 1
6 ALARM1 bits 1 1
7 ALARM2 bits 1 1
8 MOT_SPEED int16 0.2 rpm
9 DRUM_SPEED int16 0.0005 rad/s
10 TMEAS int16 0.01 N_m
11 TMEAS_AVG int16 0.01 N_m
12 ARM_CURR int16 0.01 A
13 ARM_VOLT int16 0.1 V
14 REF_ECHO int16 0.2 rpm
15 SHELL_T1 int16 0.1 degC
16 SHELL_T2 int16 0.1 degC
17 FIELD_CURR int16 0.001 A
18 TQ_IMPULSE int32 0.0001 N_m_s
20 DRUM_COUNT uint32 1 count
22 MOT_COUNT uint32 1 count
24 CMD_SEQ_ECHO uint16 1 count
25 CMD_AGE uint16 1 ms
26 SCAN_MAX uint16 0.1 ms
27 INTERLOCK bits 1 1
28 TEST_I16 int16 1 1
29 TEST_U32 uint32 1 1
31 SEQ_B uint16 1 count
64 CMD_SEQ uint16 1 count
65 HB_GW uint16 1 count
66 CTRL bits 1 1
67 MODE enum 1 1
68 SPEED_REF int16 0.2 rpm
69 SPEED_RATE int16 1 rpm/s
70 RAMP_LIMIT uint16 1 rpm/s
71 CURR_LIMIT uint16 0.01 A
72 WD_TIMEOUT uint16 1 ms
73 MAP_VERSION uint16 1 1
74 CMD_CRC uint32 1 1
76 RESERVED_76 uint16 1 1
77 RESERVED_77 uint16 1 1
78 RESERVED_78 uint16 1 1
79 RESERVED_79 uint16 1 1
"""
FLOAT32_LIST = """
100 SEQ_A uint16 1 count
101 HB_PLC uint16 1 count
102 T_PLC uint32 1 us
104 STATUS bits 1 1
105 STATE enum 1 1
106 ALARM1 bits 1 1
107 ALARM2 bits 1 1
108 MOT_SPEED float32 1 rad/s
110 DRUM_SPEED float32 1 rad/s
112 TMEAS float32 1 N_m
114 TMEAS_AVG float32 1 N_m
116 ARM_CURR float32 1 A
118 ARM_VOLT float32 1 V
120 REF_ECHO float32 1 rad/s
122 SHELL_T1 float32 1 degC
124 SHELL_T2 float32 1 degC
126 FIELD_CURR float32 1 A
128 TQ_IMPULSE int32 0.0001 N_m_s
130 DRUM_COUNT uint32 1 count
132 MOT_COUNT uint32 1 count
134 CMD_SEQ_ECHO uint16 1 count
135 CMD_AGE uint16 1 ms
136 SCAN_MAX uint16 0.1 ms
137 INTERLOCK bits 1 1
138 TEST_F32 float32 1 1
140 SEQ_B uint16 1 count
192 CMD_SEQ uint16 1 count
193 HB_GW uint16 1 count
194 CTRL bits 1 1
195 MODE enum 1 1
196 SPEED_REF float32 1 rad/s
198 SPEED_RATE float32 1 rad/s^2
200 RAMP_LIMIT float32 1 rad/s^2
202 CURR_LIMIT float32 1 A
204 WD_TIMEOUT uint16 1 ms
205 MAP_VERSION uint16 1 1
""" + "\n".join(f"{place} RESERVED_{place} uint16 1 1" for place in range(206, 224))


@pytest.mark.parametrize(
    ("name", "listed"), [("bench_int16", INT16_LIST), ("bench_float32", FLOAT32_LIST)]
)
def test_shipped_map_is_the_register_list(name, listed):
    expected = []
    for line in listed.strip().splitlines():
        address, register, type_name, digit, unit = line.split()
        expected.append((int(address), register, type_name, float(digit), unit.replace("_", " ")))
    found = register_maps.load(name).registers
    assert [(r.address, r.name, r.type, r.scale, r.unit) for r in found] == expected
    assert {(r.table, r.word_order, r.offset) for r in found} == {("holding", "ABCD", 0.0)}


@pytest.mark.parametrize(
    ("name", "blocks"),
    [("bench_int16", ((0, 32), (64, 16))), ("bench_float32", ((100, 41), (192, 32)))],
)
def test_blocks_are_those_of_the_register_list(name, blocks):
    found = register_maps.load(name)
    assert (
        (found.measurement.start, found.measurement.count),
        (found.command.start, found.command.count),
    ) == blocks


def test_limits_of_the_command_are_those_of_the_register_list():
    found = register_maps.load("bench_int16")
    ranges = {register.name: register.range for register in found.registers}
    assert ranges["SPEED_REF"] == (0.0, 4830.0)
    assert ranges["CURR_LIMIT"] == (0.0, 72.0)
    assert ranges["WD_TIMEOUT"] == (50.0, 1000.0)
    assert ranges["MODE"] == (1.0, 5.0)


@pytest.mark.parametrize("name", ["bench_int16", "bench_float32"])
def test_shipped_map_carries_every_signal_but_the_other_maps_test_constants(name):
    found = register_maps.load(name)
    missing = {signal for signal in SIGNALS if found.register(signal) is None}
    others = (
        {"test_float32"} if name == "bench_int16" else {"test_int16", "test_uint32", "command_crc"}
    )
    assert missing == others


def test_8000_hex_is_not_available_for_each_measured_int16_quantity():
    found = register_maps.load("bench_int16")
    marked = [register.name for register in found.registers if register.not_available == 0x8000]
    assert marked == [
        f"{name}"
        for name in (
            "MOT_SPEED",
            "DRUM_SPEED",
            "TMEAS",
            "TMEAS_AVG",
            "ARM_CURR",
            "ARM_VOLT",
            "REF_ECHO",
            "SHELL_T1",
            "SHELL_T2",
            "FIELD_CURR",
        )
    ]


def test_names_are_the_files_beside_the_package():
    assert register_maps.names() == tuple(MAPS)
    assert {"bench_int16", "bench_float32"} <= set(MAPS)


@pytest.mark.parametrize("name", MAPS)
def test_every_map_loads_by_name_and_by_path_alike(name):
    path = FOLDER / f"{name}.toml"
    by_name, by_path = register_maps.load(name), register_maps.load(str(path))
    assert by_name.registers == by_path.registers
    assert by_name.name == name
    assert by_name.source_hash == hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize("name", MAPS)
def test_every_map_fits_one_read_and_one_write(name):
    found = register_maps.load(name)
    assert found.measurement.count <= 125
    assert found.command.count <= 123
    for register in found.registers:
        block = found.measurement if register.access == "read" else found.command
        assert block.start <= register.address
        assert register.end <= block.end


@pytest.mark.parametrize("name", MAPS)
def test_every_map_has_a_constant_that_proves_the_word_order(name):
    constants = [r for r in register_maps.load(name).registers if r.constant and r.raw.words == 2]
    assert constants
    for register in constants:
        words = encode_value(register, register.si_unit.to_si(register.constant))
        for order in {"ABCD", "CDAB", "BADC", "DCBA"} - {register.word_order}:
            with pytest.raises(CodecError, match="constant"):
                decode_value(replace(register, word_order=order), words)


@pytest.mark.parametrize("name", MAPS)
def test_every_register_carries_the_ends_of_its_range(name):
    for register in register_maps.load(name).registers:
        for end in register.range:
            if register.constant is None and register.signal != "reserved":
                value = register.si_unit.to_si(end)
                seen = decode_value(register, encode_value(register, value))
                assert register.si_unit.from_si(seen) == pytest.approx(end, rel=1e-6)


@pytest.mark.parametrize("name", MAPS)
def test_every_register_says_what_it_is_and_who_says_so(name):
    for register in register_maps.load(name).registers:
        assert register.description
        assert register.source
        assert register.reference == 40001 + register.address


def test_log_columns_are_those_of_the_log_file():
    """Column, unit, needed: as the log format has them."""
    assert {c.column: (c.unit, c.needed) for c in LOG_COLUMNS.values()} == {
        "time_s": ("s", True),
        "speed_reference_rad_s": ("rad/s", True),
        "motor_speed_rad_s": ("rad/s", True),
        "drum_speed_rad_s": ("rad/s", True),
        "armature_current_A": ("A", False),
        "shaft_torque_Nm": ("N m", True),
        "wheel_torque_Nm": ("N m", False),
        "armature_voltage_V": ("V", False),
        "shell_temperature_degC": ("degC", False),
        "reference_knee_time_s": ("s", False),
        "reference_knee_rad_s": ("rad/s", False),
        "reference_knee_2_time_s": ("s", False),
        "reference_knee_2_rad_s": ("rad/s", False),
        "reference_knee_3_time_s": ("s", False),
        "reference_knee_3_rad_s": ("rad/s", False),
        "truck_on_drum": ("1", False),
    }
    for column in LOG_COLUMNS.values():
        if column.measured is not None:
            assert SIGNALS[column.measured].unit == UNITS[column.unit].si
