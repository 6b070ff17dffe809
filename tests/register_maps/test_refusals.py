"""What a map may not hold is refused at load, with the file and the line where it stands."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import register_maps
from register_maps.entry import Lines
from register_maps.parse import parse
from register_maps.register_map import MapError

SHIPPED = (Path(register_maps.__file__).parent / "bench_int16.toml").read_text()


def refused(tmp_path, text):
    path = tmp_path / "some plc.toml"
    path.write_text(text)
    with pytest.raises(MapError) as caught:
        register_maps.load(path)
    message = str(caught.value)
    assert message.startswith(f"{path}:{caught.value.line}: ")
    assert "\n" not in message
    assert "expected" in message
    return caught.value


def changed(register, key, new):
    """The shipped map with one line changed ("" takes it away), and that line's number."""
    lines = SHIPPED.splitlines()
    first = 0 if register == "map" else lines.index(f'name = "{register}"') - 1
    place = next(n for n in range(first, len(lines)) if lines[n].startswith(f"{key} ="))
    if new:
        lines[place] = new
        return "\n".join(lines), place + 1
    del lines[place]
    return "\n".join(lines), first + 1  # the header of the register


WRONG_VALUES = [
    # register, key, line instead, what the answer must say
    ("TMEAS", "address", "address = 9", "DRUM_SPEED has 9 .. 9"),
    ("DRUM_COUNT", "address", "address = 18", "TQ_IMPULSE has 18 .. 19"),
    ("TMEAS", "signal", 'signal = "torque"', "shaft_torque"),
    ("TMEAS", "signal", "signal = 3", "shaft_torque"),
    ("TMEAS_AVG", "signal", 'signal = "shaft_torque"', "no other register"),
    ("TMEAS", "name", 'name = "DRUM_SPEED"', "no other register"),
    ("TMEAS", "unit", 'unit = "Nm"', "N m"),
    ("TMEAS", "unit", 'unit = "rpm"', "a unit of shaft_torque: N m"),
    ("TMEAS", "unit", "unit = []", "rpm"),
    ("TMEAS", "range", "range = [-327.67, 327.68]", "inside -327.68 .. 327.67"),
    ("CURR_LIMIT", "range", "range = [-1, 72]", "inside 0 .. 655.35"),
    ("CURR_LIMIT", "range", "range = [72, 0]", "[lowest, highest]"),
    ("CURR_LIMIT", "range", "range = [0, inf]", "finite"),
    ("CURR_LIMIT", "range", "range = [0.001, 0.002]", "at least one value"),
    ("CURR_LIMIT", "range", "range = 72", "[lowest, highest]"),
    ("T_PLC", "range", "range = [0, 86400000.05]", "since it wraps"),
    ("TMEAS", "address", "address = 32", "measurement block 0 .. 31"),
    ("CMD_CRC", "address", "address = 79", "the whole value in one request"),
    ("T_PLC", "address", "address = 31", "the whole value in one request"),
    ("SEQ_A", "address", "address = -1", "0 .. 65535"),
    ("SEQ_A", "address", "address = 65536", "0 .. 65535"),
    ("T_PLC", "address", "address = 65535", "0 .. 65534"),
    ("SEQ_A", "address", "address = 1.0", "whole number"),
    ("SEQ_A", "address", 'address = "40001"', "whole number"),
    ("SEQ_A", "address", "address = true", "whole number"),
    ("TMEAS", "type", 'type = "int8"', "int16"),
    ("TMEAS", "type", 'type = "bits"', "can carry shaft_torque"),
    ("STATUS", "type", 'type = "uint16"', "can carry status: bits"),
    ("STATE", "type", 'type = "bits"', "can carry plc_state: enum"),
    ("SEQ_A", "type", 'type = "float32"', "can carry sequence_start"),
    ("TMEAS", "scale", "scale = 0", "other than 0"),
    ("TMEAS", "scale", "scale = nan", "finite"),
    ("TMEAS", "scale", 'scale = "0.01"', "finite number"),
    ("SEQ_A", "scale", "scale = 2", "not a quantity"),
    ("SEQ_A", "offset", "offset = 1", "not a quantity"),
    ("TMEAS", "table", 'table = "coil"', "holding, input"),
    ("TMEAS", "table", 'table = "input"', "holding, to be in the one request"),
    ("CTRL", "table", 'table = "input"', "cannot be written"),
    ("TMEAS", "access", 'access = "write"', "shaft_torque is a measurement"),
    ("CTRL", "access", 'access = "read"', "control is a command"),
    ("TMEAS", "access", 'access = "rw"', "read, write"),
    ("TMEAS", "description", 'description = " "', "not empty"),
    ("TMEAS", "source", "source = 7", "a text"),
    ("TMEAS", "name", 'name = ""', "not empty"),
    ("TMEAS", "scale", 'scale = 0.01\nword_order = "ABDC"', "ABCD, CDAB, BADC, DCBA"),
    ("TMEAS", "not_available", "not_available = 0x7000", "outside the range"),
    ("TMEAS", "not_available", "not_available = 0x18000", "0 .. 65535"),
    ("TMEAS", "not_available", "not_available = -32768", "0 .. 65535"),
    ("TEST_I16", "constant", "constant = 40000", "can hold"),
    ("TEST_I16", "constant", "constant = 0.5", "can hold"),
    ("SEQ_A", "wraps", "wraps = 1", "true or false"),
    ("CMD_CRC", "crc", 'crc = "crc16"', "crc32"),
    ("STATUS", "offset", "offset = 0\nwraps = true", "only int16"),
    ("RESERVED", "type", 'type = "bits"', "means nothing"),
    ("RESERVED", "count", "count = 0", "a whole number 1 .."),
    ("CMD_SEQ", "offset", "offset = 0\ncount = 2", "only reserved"),
    ("CMD_SEQ", "offset", 'offset = 0\ncrc = "crc32"', "only a command_crc"),
    ("map", "version", "version = 70000", "0 .. 65535"),
    ("map", "name", "name = 3", "a text"),
    ("map", "word_order", 'word_order = "big"', "ABCD, CDAB, BADC, DCBA"),
    ("map", "measurement", "measurement = { start = 0, count = 126 }", "1 .. 125"),
    ("map", "command", "command = { start = 64, count = 124 }", "1 .. 123"),
    ("map", "command", "command = { start = 64, count = 17 }", "a register at address 80"),
    ("map", "command", "command = { start = 31, count = 49 }", "beside the measurement block 0"),
    ("map", "command", "command = { start = 65530, count = 16 }", "0 .. 65535"),
    ("map", "command", "command = { start = 64 }", "a block"),
    ("map", "command", "command = { start = 64.0, count = 16 }", "whole numbers"),
    ("map", "command", 'command = { table = "input", start = 64, count = 16 }', "a block"),
    ("map", "measurement", "measurement = 32", "a block"),
]


@pytest.mark.parametrize(("register", "key", "new", "expected"), WRONG_VALUES)
def test_a_wrong_value_is_refused_with_its_line(tmp_path, register, key, new, expected):
    text, line = changed(register, key, new)
    error = refused(tmp_path, text)
    assert error.line == line + new.count("\n")
    assert expected in error.expected


@pytest.mark.parametrize(
    "key",
    [
        "name",
        "signal",
        "table",
        "address",
        "type",
        "unit",
        "range",
        "access",
        "description",
        "source",
    ],
)
def test_a_missing_key_is_refused_with_the_line_of_its_register(tmp_path, key):
    text, line = changed("DRUM_SPEED", key, "")
    error = refused(tmp_path, text)
    assert (error.line, error.value) == (line, "missing")
    assert error.place.endswith(f".{key}")


@pytest.mark.parametrize("key", ["scale", "offset"])
def test_scale_and_offset_are_1_and_0_where_they_are_not_written(tmp_path, key):
    path = tmp_path / "map.toml"
    path.write_text(changed("SEQ_A", key, "")[0])
    assert register_maps.load(path).registers[0].scale == 1.0


@pytest.mark.parametrize(
    ("register", "key", "line"),
    [("TMEAS", "unit", 'unit = "N m"\nuint = "N m"'), ("map", "version", "version = 1\nuint = 2")],
)
def test_an_unknown_key_is_refused_with_its_line(tmp_path, register, key, line):
    text, place = changed(register, key, line)
    error = refused(tmp_path, text)
    assert error.line == place + 1
    assert "a known key" in error.expected


def test_a_float_has_no_pattern_for_not_available(tmp_path):
    path = Path(register_maps.__file__).parent / "bench_float32.toml"
    before, after = path.read_text().split('name = "TMEAS"\n')
    text = before + 'name = "TMEAS"\nnot_available = 0x7FC00000\n' + after
    error = refused(tmp_path, text)
    assert error.line == before.count("\n") + 2
    assert "only an integer" in error.expected


def test_a_checksum_of_nothing_is_refused(tmp_path):
    text = SHIPPED.replace("address = 74", "address = CRC")
    for address in range(73, 63, -1):
        text = text.replace(f"address = {address}\n", f"address = {address + 2}\n")
    error = refused(tmp_path, text.replace("address = CRC", "address = 64"))
    assert error.line == changed("CMD_CRC", "crc", "x")[1]
    assert "at least one word before it" in error.expected


def test_an_unknown_table_is_refused_with_its_line(tmp_path):
    error = refused(tmp_path, SHIPPED + "\n[registers]\nx = 1\n")
    assert error.line == SHIPPED.count("\n") + 2


NEEDED = {
    "sequence_start": "SEQ_A",
    "sequence_end": "SEQ_B",
    "plc_heartbeat": "HB_PLC",
    "plc_time": "T_PLC",
    "status": "STATUS",
    "motor_speed": "MOT_SPEED",
    "drum_speed": "DRUM_SPEED",
    "shaft_torque": "TMEAS",
    "command_sequence": "CMD_SEQ",
    "gateway_heartbeat": "HB_GW",
    "control": "CTRL",
    "mode": "MODE",
    "speed_setpoint": "SPEED_REF",
}


def without(name):
    """The shipped map without the register; in the command block reserved words in its place."""
    tables = SHIPPED.split("[[register]]")
    wanted = next(table for table in tables if f'name = "{name}"\n' in table)
    if 'access = "read"' in wanted:
        return "[[register]]".join(table for table in tables if table is not wanted)
    kept = {"table", "address", "access", "description", "source"}
    rows = [row for row in wanted.splitlines() if row.split(" =")[0] in kept]
    rows += ['name = "X"', 'signal = "reserved"', 'type = "uint16"', 'unit = "1"', "range = [0, 0]"]
    other = "\n" + "\n".join(rows) + "\n"
    return "[[register]]".join(other if table is wanted else table for table in tables)


@pytest.mark.parametrize(("signal", "name"), NEEDED.items())
def test_a_map_without_a_needed_signal_is_refused(tmp_path, signal, name):
    error = refused(tmp_path, without(name))
    assert error.line == SHIPPED.splitlines().index("[map]") + 1
    assert error.expected == f"also a register for {signal}"


@pytest.mark.parametrize("name", ["TMEAS_AVG", "FIELD_CURR", "STATE", "RAMP_LIMIT"])
def test_a_map_without_any_other_signal_loads(tmp_path, name):
    path = tmp_path / "map.toml"
    path.write_text(without(name))
    loaded = register_maps.load(path)
    assert all(register.name != name for register in loaded.registers)


def test_a_command_block_with_an_unnamed_word_is_refused(tmp_path):
    tables = SHIPPED.split("[[register]]")
    text = "[[register]]".join(table for table in tables if '"RAMP_LIMIT"' not in table)
    error = refused(tmp_path, text)
    assert "a register at address 70" in error.expected
    assert error.line == changed("map", "command", "x")[1]


def test_measurements_may_lie_among_the_input_registers(tmp_path):
    tables = SHIPPED.replace('{ table = "holding", start = 0', '{ table = "input", start = 0')
    rows = tables.split("[[register]]")
    moved = [
        row.replace('table = "holding"', 'table = "input"') if 'access = "read"' in row else row
        for row in rows
    ]
    path = tmp_path / "map.toml"
    path.write_text("[[register]]".join(moved))
    loaded = register_maps.load(path)
    assert loaded.measurement.table == "input"
    assert loaded.register("motor_speed").reference == 30009


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("[map]\nversion = \n", 2),
        ("[map]\nname = 'x'\nname = 'y'\n", 3),
        ('[map]\n\nname = "never closed\n', 3),
        ("", 1),
        ("map = 3\n", 1),
        ("[map]\n\n[register]\nname = 'x'\n", 3),
        ("[map]\nregister = 3\n", 2),
        ("\n\nregister = 3\n[map]\n", 3),
        ("register = [3]\n[map]\n", 1),
    ],
)
def test_a_file_that_is_no_map_is_refused(tmp_path, text, line):
    assert refused(tmp_path, text).line == line


def test_a_file_that_is_not_there_or_not_text_is_refused(tmp_path):
    with pytest.raises(MapError, match="bench_float32, bench_int16"):
        register_maps.load("bench_int32")
    with pytest.raises(MapError):
        register_maps.load(tmp_path)
    path = tmp_path / "binary.toml"
    path.write_bytes(b"# comment\n\xff\n")
    with pytest.raises(MapError, match="UTF-8") as caught:
        register_maps.load(path)
    assert caught.value.line == 2


def test_lines_in_a_text_of_several_lines_are_no_keys():
    text = (
        '[map]\ndescription = """\nname = 1\n[[register]]\n"""\nname = 2\n[[register]]\nunit = 1\n'
    )
    lines = Lines(text)
    assert lines.of("map", 1, "name") == 6
    assert lines.of("register", 1, None) == 7
    assert lines.of("register", 1, "unit") == 8
    assert lines.of("register", 1, "scale") == 7


@given(st.data())
def test_a_map_with_one_line_spoilt_loads_or_is_refused_and_nothing_else(data):
    lines = SHIPPED.splitlines()
    place = data.draw(st.integers(0, len(lines) - 1))
    value = st.sampled_from(
        ["-1", "1e400", "nan", '"x"', "[]", "{}", "true", "1e-320", "[[1], 2]", "70000"]
    )
    key = lines[place].split(" =")[0]
    lines[place] = f"{key} = {data.draw(value)}"
    path = Path("spoilt.toml")
    try:
        parse(
            tomllib.loads("\n".join(lines)),
            file=str(path),
            lines=Lines("\n".join(lines)),
            source_hash="",
        )
    except tomllib.TOMLDecodeError:
        return
    except MapError as error:
        assert error.line >= 1


def test_an_error_ends_the_command_with_2():
    assert MapError.exit_code == 2


def test_the_package_imports_nothing_that_a_pure_part_may_not():
    foreign = "{'socket', 'asyncio', 'numpy', 'pymodbus', 'click'}"
    code = f"import sys, register_maps.codec; print(*({foreign} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
