"""Words that a foreign program wrote (libmodbus, in C) mean what the codec says."""

import subprocess
from pathlib import Path

import pytest

import register_maps
from register_maps.codec import decode_value, encode_value
from register_maps.register_map import Register

pytestmark = pytest.mark.peer

FLOATS = ("123.456", "-12.8", "376.99112", "0", "1.17549435e-38", "-3.4e38", "1e-20")
INTEGERS = ("305419896", "-12345", "-2147483648", "2147483647", "0", "-1", "32767", "65536")

# The letters of libmodbus's float functions: up to 3.1.7 on a little-endian host they name the
# bytes as they lie in the host's memory, where each word is turned round; later ones, the wire.
BY_WIRE = {"abcd": "ABCD", "cdab": "CDAB", "badc": "BADC", "dcba": "DCBA"}
BY_MEMORY = {"abcd": "BADC", "cdab": "DCBA", "badc": "ABCD", "dcba": "CDAB"}


@pytest.fixture(scope="module")
def foreign(require_program, tmp_path_factory):
    """Run the C program: ("f" or "i", values) -> list of (how, value, words)."""
    compiler, package = require_program("gcc"), require_program("pkg-config")
    asked = subprocess.run(
        [package, "--cflags", "--libs", "libmodbus"], capture_output=True, text=True, check=False
    )
    if asked.returncode != 0:
        require_program("libmodbus-dev")  # says that it is not installed
    program = tmp_path_factory.mktemp("foreign") / "foreign_words"
    source = Path(__file__).with_name("foreign_words.c")
    subprocess.run([compiler, source, "-o", program, *asked.stdout.split()], check=True)

    def words(kind, values):
        printed = subprocess.run(
            [program, kind, *values], capture_output=True, text=True, check=True
        ).stdout
        rows = [line.split() for line in printed.splitlines()]
        return [(how, value, tuple(map(int, rest))) for how, value, *rest in rows]

    return words


def a_register(type_name, order="ABCD"):
    ends = {
        "float32": (-3.4028234e38, 3.4028234e38),
        "int32": (-(2.0**31), 2.0**31 - 1),
        "int16": (-32768.0, 32767.0),
    }
    return Register(
        name="FOREIGN",
        signal="shaft_torque_mean",
        table="holding",
        address=0,
        type=type_name,
        word_order=order,
        scale=1.0,
        offset=0.0,
        unit="N m",
        range=ends[type_name],
        access="read",
        description="written by libmodbus",
        source="libmodbus",
    )


def test_floats_of_libmodbus_in_all_four_orders(foreign):
    rows = foreign("f", FLOATS)
    first = next(words for how, _, words in rows if how == "abcd")
    letters = BY_WIRE if first == (0x42F6, 0xE979) else BY_MEMORY
    assert len(rows) == 5 * len(FLOATS)
    for how, value, words in rows:
        register = a_register("float32", letters.get(how, "CDAB"))  # modbus_set_float: low first
        assert decode_value(register, words) == pytest.approx(float(value), rel=1e-7)
        assert encode_value(register, float(value)) == words


def test_integers_of_libmodbus(foreign):
    rows = foreign("i", INTEGERS)
    assert len(rows) == 2 * len(INTEGERS)
    for how, value, words in rows:
        if how == "int32" or -32768 <= int(value) <= 32767:
            register = a_register(how)
            assert decode_value(register, words) == int(value)
            assert encode_value(register, int(value)) == words


def test_constants_of_the_shipped_maps_are_the_words_that_libmodbus_writes(foreign):
    by_value = {(how, value): words for how, value, words in foreign("i", INTEGERS)}
    by_value |= {(how, value): words for how, value, words in foreign("f", FLOATS)}
    int16, float32 = register_maps.load("bench_int16"), register_maps.load("bench_float32")
    shown = encode_value(int16.register("test_uint32"), None)
    assert shown == by_value["int32", "305419896"]
    assert encode_value(int16.register("test_int16"), None) == by_value["int16", "-12345"]
    low_first = by_value["plain", "123.456"]
    assert encode_value(float32.register("test_float32"), None) == low_first[::-1]
