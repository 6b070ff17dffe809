"""Each fault, on images and on frames that are written out field by field."""

import pytest

from plant_emulator.emulator.plc import faults
from plant_emulator.emulator.plc.faults import Fault, FaultError
from register_maps import load

INT16 = load("bench_int16")
FLOAT32 = load("bench_float32")
# The names that a user may type.
KNOWN = [
    "frozen_heartbeat",
    "frozen_image",
    "late_reply",
    *[f"exception_{code}" for code in range(1, 12)],
    "nan",
    "torn_image",
    "drop_mid_reply",
    "refuse_connection",
    "restart",
    "wrong_function",
    "wrong_count",
    "wrong_transaction",
    "word_order",
]
#                     transaction  protocol   length     unit  fc    bytes  2 registers
READ = bytes.fromhex("0102         0000       0007       01    03    04     000A 000B")
#                     transaction  protocol   length     unit  fc    start  quantity
WRITE = bytes.fromhex("0102        0000       0006       01    10    0040   0010")


def words(count: int, first: int) -> tuple[int, ...]:
    return tuple(range(first, first + count))


def shown(name, register_map=INT16, fresh=1000, previous=2000, before=3000):
    count = register_map.measurement.count
    return faults.image(
        frozenset({name} if name else ()),
        register_map,
        words(count, fresh),
        words(count, previous),
        words(count, before),
    )


def frame(name: str, reply: bytes = READ) -> bytes:
    (chunk,) = faults.reply(frozenset({name}), reply)
    assert chunk.delay == 0.0
    return chunk.data


def test_names_are_those_that_users_know():
    assert sorted(faults.NAMES) == sorted(KNOWN)


@pytest.mark.parametrize("name", KNOWN)
def test_every_name_is_understood_with_and_without_a_start(name):
    assert faults.parse(name) == Fault(name=name, start=0.0)
    assert faults.parse(f"{name}@2.5") == Fault(name=name, start=2.5)


@pytest.mark.parametrize("text", ["gremlins", "", "exception_0", "exception_12", "NAN"])
def test_unknown_fault_is_refused_with_the_known_ones(text):
    with pytest.raises(FaultError, match="one of frozen_heartbeat") as refused:
        faults.parse(text)
    assert refused.value.exit_code == 2


@pytest.mark.parametrize("start", ["", "soon", "-1", "nan", "inf"])
def test_start_that_is_no_time_is_refused(start):
    with pytest.raises(FaultError, match="NAME@SECONDS"):
        faults.parse(f"nan@{start}")


def test_fault_is_active_from_its_start_on():
    both = [Fault(name="nan", start=2.0), Fault(name="late_reply")]
    assert faults.active(both, 1.99) == {"late_reply"}
    assert faults.active(both, 2.0) == {"nan", "late_reply"}


def test_no_fault_changes_nothing():
    assert shown(None) == words(32, 1000)
    assert faults.reply(frozenset(), READ) == (faults.Chunk(data=READ),)


def test_frozen_image_shows_what_was_shown():
    assert shown("frozen_image") == words(32, 3000)


def test_frozen_heartbeat_holds_one_word_and_no_other():
    # HB_PLC is word 1 of the int16 block
    image = shown("frozen_heartbeat")
    assert image[1] == 3001
    assert (*image[:1], *image[2:]) == (1000, *words(30, 1002))


def test_torn_image_ends_with_the_scan_before():
    image = shown("torn_image")
    assert (image[0], image[-1]) == (1000, 2031)


def test_nan_of_a_float_map_is_in_every_measured_float_and_nowhere_else():
    # In the map: floats are 108 to 126, the test constant at 138 is no measurement.
    image = shown("nan", FLOAT32)
    changed = [100 + k for k, word in enumerate(image) if word != 1000 + k]
    assert changed == list(range(108, 128))
    assert {image[address - 100] for address in changed} == {0xFFFF}


def test_nan_of_an_integer_map_is_its_not_available():
    # In the map: 8 to 17 are the int16 measurements; 28 is a constant.
    image = shown("nan")
    changed = [k for k, word in enumerate(image) if word != 1000 + k]
    assert changed == list(range(8, 18))
    assert {image[k] for k in changed} == {0x8000}


def test_word_order_swaps_the_words_of_each_32_bit_value():
    # In the map: T_PLC 2-3, TQ_IMPULSE 18-19, counts 20-23, TEST_U32 29-30.
    image = shown("word_order")
    changed = [k for k, word in enumerate(image) if word != 1000 + k]
    assert changed == [2, 3, 18, 19, 20, 21, 22, 23, 29, 30]
    assert image[29:31] == (1030, 1029)


@pytest.mark.parametrize("code", range(1, 12))
def test_exception_is_a_frame_of_two_bytes_with_its_code(code):
    assert frame(f"exception_{code}") == bytes.fromhex(f"0102 0000 0003 01 83 {code:02X}")
    assert frame(f"exception_{code}", WRITE) == bytes.fromhex(f"0102 0000 0003 01 90 {code:02X}")
    assert faults.refuses_requests(frozenset({f"exception_{code}"}))


def test_wrong_function_differs_in_nothing_else():
    assert frame("wrong_function") == READ.replace(b"\x01\x03\x04", b"\x01\x04\x04")
    assert frame("wrong_function", WRITE)[7] == 15


def test_wrong_count_of_a_read_is_a_sound_frame_with_one_register_less():
    assert frame("wrong_count") == bytes.fromhex("0102 0000 0005 01 03 02 000A")


def test_wrong_count_of_a_write_confirms_one_register_less():
    assert frame("wrong_count", WRITE) == bytes.fromhex("0102 0000 0006 01 10 0040 000F")


@pytest.mark.parametrize(("sent", "answered"), [("0102", "0103"), ("FFFF", "0000")])
def test_wrong_transaction_is_the_next_one(sent, answered):
    reply = bytes.fromhex(sent) + READ[2:]
    assert frame("wrong_transaction", reply) == bytes.fromhex(answered) + READ[2:]


def test_late_reply_is_whole_but_later_than_100_ms():
    (chunk,) = faults.reply(frozenset({"late_reply"}), READ)
    assert chunk.data == READ
    assert chunk.delay > 0.1


def test_drop_mid_reply_sends_a_part_and_hangs_up():
    part, end = faults.reply(frozenset({"drop_mid_reply"}), READ)
    assert READ.startswith(part.data)
    assert 0 < len(part.data) < len(READ)
    assert end.data is None


def test_only_refuse_connection_closes_the_port():
    assert [name for name in KNOWN if faults.refuses(frozenset({name}))] == ["refuse_connection"]


def test_faults_add_up():
    both = frozenset({"wrong_transaction", "drop_mid_reply"})
    part, end = faults.reply(both, READ)
    assert part.data[:2] == b"\x01\x03"
    assert end.data is None
