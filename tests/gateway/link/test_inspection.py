"""The operator's view of a map; words as the map and the Modbus specification give them."""

import pytest

import register_maps
from gateway.errors import ConfigError
from gateway.link.device import encode_scaled, writable
from gateway.link.inspection import (
    Reading,
    RegisterRow,
    mbpoll,
    value_in_other_order,
    value_text,
    verify,
)
from register_maps.codec import encode_measurement
from register_maps.register_map import RegisterMap
from register_maps.signals import SIGNALS, Measurement, Status

MAP = register_maps.load("bench_int16")
ZEROS = {
    name: 0
    for name, signal in SIGNALS.items()
    if signal.kind == "measurement"
    and not name.startswith(("sequence", "plc_h", "plc_t", "status"))
}


def reading(heartbeat: int, **changed: float) -> dict[str, tuple[int, ...]]:
    """A standing bench, warm, as its PLC would show it."""
    signals = ZEROS | {"shell_temperature_1": 305.15, "shell_temperature_2": 305.15} | changed
    words = encode_measurement(
        MAP,
        Measurement(
            sequence_start=heartbeat,
            sequence_end=heartbeat,
            plc_heartbeat=heartbeat,
            plc_time=0.01 * heartbeat,
            status=Status.READY,
            **signals,  # type: ignore[arg-type]
        ),
    )
    found = {one.name: words[one.address : one.end] for one in MAP.registers if one.end <= 32}
    return found | {one.name: (0,) * one.raw.words for one in MAP.registers if one.address >= 64}


def rows(*readings: Reading, register_map: RegisterMap = MAP) -> dict[str, RegisterRow]:
    return {row.register.name: row for row in verify(register_map, readings).rows}


def register(name: str):  # type: ignore[no-untyped-def]
    return next(found for found in MAP.registers if found.name == name)


def test_a_standing_bench_holds() -> None:
    found = rows(reading(100), reading(115))
    assert [row.finding for row in found.values() if not row.holds] == []
    assert "constant zero" in found["MOT_SPEED"].finding
    assert found["SHELL_T1"].value == pytest.approx(32.0)


def test_a_sequence_that_stands_still_is_named() -> None:
    found = rows(reading(100), reading(100))
    for name in ("SEQ_A", "HB_PLC", "T_PLC", "SEQ_B"):
        assert "not moving" in found[name].finding
        assert not found[name].holds


def test_exchanged_words_are_called_a_wrong_word_order() -> None:
    """0x12345678 with its words exchanged."""
    exchanged = [one | {"TEST_U32": (0x5678, 0x1234)} for one in (reading(100), reading(115))]
    row = rows(*exchanged)["TEST_U32"]
    assert not row.holds
    assert "wrong word order" in row.finding
    assert "CDAB fits" in row.finding


def test_another_constant_is_out_of_range_not_out_of_order() -> None:
    changed = [one | {"TEST_U32": (0, 1)} for one in (reading(100), reading(115))]
    assert "out of range" in rows(*changed)["TEST_U32"].finding


def test_a_temperature_of_400_degrees_is_out_of_range() -> None:
    hot = [one | {"SHELL_T1": (4000,)} for one in (reading(100), reading(115))]
    row = rows(*hot)["SHELL_T1"]
    assert not row.holds
    assert "out of range: 400 degC" in row.finding


def test_a_register_that_gave_an_error_is_unreadable() -> None:
    lost = [one | {"ARM_CURR": "exception 2"} for one in (reading(100), reading(115))]
    row = rows(*lost)["ARM_CURR"]
    assert (row.holds, row.words, row.finding) == (False, (), "unreadable: exception 2")


def test_a_zero_that_no_running_plc_has_fails() -> None:
    cold = [one | {"SHELL_T1": (0,)} for one in (reading(100), reading(115))]
    assert not rows(*cold)["SHELL_T1"].holds


def test_values_are_shown_in_the_maps_unit_and_in_the_other_order() -> None:
    assert value_text(register("MOT_SPEED"), (500,)) == "100"  # 500 digits of 0.2 rpm
    assert value_text(register("FIELD_CURR"), (0x8000,)) == "not available"
    assert value_text(register("TEST_U32"), (0x1234, 0x5678)) == "305419896"
    assert value_text(register("T_PLC"), (0x0001, 0x0000)) == "6553.6"
    assert value_in_other_order(register("T_PLC"), (0x0001, 0x0000)) == "0.1"
    assert value_in_other_order(register("MOT_SPEED"), (500,)) == ""


@pytest.mark.parametrize(
    ("name", "words", "call"),
    [
        ("MOT_SPEED", None, "-r 8 -c 1 -t 4 -p 5020 127.0.0.1"),
        ("T_PLC", None, "-r 2 -c 1 -t 4:int -B -p 5020 127.0.0.1"),
        ("SPEED_REF", (500,), "-r 68 -t 4 -p 5020 127.0.0.1 500"),
    ],
)
def test_the_call_of_mbpoll_is_the_one_of_its_manual(
    name: str, words: tuple[int, ...] | None, call: str
) -> None:
    full = mbpoll(register(name), "127.0.0.1", 5020, 1, writing=words)
    assert full == f"mbpoll -q -1 -0 -a 1 {call}"


def test_a_value_is_encoded_from_the_maps_unit() -> None:
    assert encode_scaled(register("SPEED_REF"), 100.0) == (500,)
    assert encode_scaled(register("WD_TIMEOUT"), 200.0) == (200,)
    assert encode_scaled(register("SPEED_RATE"), -3.0) == (0xFFFD,)


@pytest.mark.parametrize(("name", "value"), [("SPEED_REF", 4830.2), ("WD_TIMEOUT", 49.0)])
def test_a_value_outside_the_maps_range_is_refused(name: str, value: float) -> None:
    with pytest.raises(ConfigError, match=name) as caught:
        encode_scaled(register(name), value)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("name", ["TMEAS", "RESERVED_76", "nothing"])
def test_only_what_the_map_lets_one_write_may_be_written(name: str) -> None:
    with pytest.raises(ConfigError, match="SPEED_REF"):
        writable(MAP, name)
