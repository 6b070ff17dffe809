"""`gateway registers` against the emulator."""

import json
from collections.abc import Iterator

import pytest
from click.testing import CliRunner, Result

from gateway.cli.registers import command
from gateway.errors import ConfigError
from plant_emulator.emulator.process import EmulatorProcess

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def emulator() -> Iterator[EmulatorProcess]:
    with EmulatorProcess() as running:
        yield running


def call(emulator: EmulatorProcess, *arguments: str, text: str | None = None) -> Result:
    return CliRunner().invoke(
        command,
        [*arguments, "--port", str(emulator.port)],
        input=text,
        standalone_mode=False,
        catch_exceptions=False,
    )


def test_read_shows_words_value_and_call(emulator: EmulatorProcess) -> None:
    lines = call(emulator, "read", "bench_int16").output.splitlines()
    line = next(line for line in lines if line.startswith("TEST_U32"))
    assert line.split()[1:6] == ["29", "(40030)", "1234", "5678", "305419896"]
    assert f"mbpoll -q -1 -0 -a 1 -r 29 -c 1 -t 4:int -B -p {emulator.port} 127.0.0.1" in line


def test_verify_holds_on_the_right_map_and_not_on_another(emulator: EmulatorProcess) -> None:
    right = call(emulator, "verify", "bench_int16", "--json", "-")
    assert right.return_value == 0
    answer = json.loads(right.output)
    assert (answer["schema"], answer["holds"]) == ("register-map/1", True)
    assert set(answer["registers"][0]) == {"name", "address", "raw", "value", "unit", "finding"}
    wrong = call(emulator, "verify", "bench_float32")
    assert wrong.return_value == 1
    assert "unreadable" in wrong.output


def test_verify_finds_exchanged_words(emulator: EmulatorProcess) -> None:
    emulator.set_faults("word_order")
    try:
        found = json.loads(call(emulator, "verify", "bench_int16", "--json", "-").output)
    finally:
        emulator.set_faults()
    findings = {entry["name"]: entry["finding"] for entry in found["registers"]}
    assert findings["TEST_U32"].startswith("wrong word order")


def test_write_asks_first_and_writes_after_yes(emulator: EmulatorProcess) -> None:
    refused = CliRunner().invoke(
        command,
        ["write", "bench_int16", "WD_TIMEOUT", "250", "--port", str(emulator.port)],
        input="n\n",
    )
    assert refused.exit_code == 1
    done = call(emulator, "write", "bench_int16", "WD_TIMEOUT", "250", text="y\n")
    assert "reads back 00FA = 250 ms" in done.output


def test_write_tells_the_value_that_the_register_can_hold(emulator: EmulatorProcess) -> None:
    done = call(emulator, "write", "bench_int16", "WD_TIMEOUT", "250.4", "--yes")
    assert "WD_TIMEOUT = 250 ms, nearest to 250.4: 00FA" in done.output
    exact = call(emulator, "write", "bench_int16", "WD_TIMEOUT", "250", "--yes")
    assert "WD_TIMEOUT = 250 ms: 00FA" in exact.output


def test_watch_prints_what_moves(emulator: EmulatorProcess) -> None:
    lines = call(emulator, "watch", "bench_int16", "--count", "2", "--interval", "0.05").output
    assert sum(line.startswith("HB_PLC") for line in lines.splitlines()) == 2
    assert sum(line.startswith("TEST_U32") for line in lines.splitlines()) == 1


def test_list_needs_no_device() -> None:
    result = CliRunner().invoke(command, ["list", "bench_int16"])
    assert "40030" in result.output
    assert "ABCD 1234 5678, CDAB 5678 1234" in result.output
    assert "mbpoll -q -1 -0 -a 1 -r 29 -c 1 -t 4:int -B -p 5020 127.0.0.1" in result.output


@pytest.mark.parametrize(
    ("register", "value", "words"),
    [
        ("CTRL", "enable", "0001"),
        ("CTRL", "enable+fault-reset", "0003"),
        ("CTRL", "none", "0000"),
        ("MODE", "road_load", "0004"),
        ("MODE", "3", "0003"),
    ],
)
def test_bits_and_states_are_written_by_their_names(
    emulator: EmulatorProcess, register: str, value: str, words: str
) -> None:
    done = call(emulator, "write", "bench_int16", register, value, "--yes")
    assert f"reads back {words} = " in done.output


@pytest.mark.parametrize(
    ("register", "value", "expected"),
    [
        ("CTRL", "go", "enable, fault_reset"),
        ("MODE", "speed+ready", "road_load"),
        ("WD_TIMEOUT", "long", "expected a number$"),
    ],
)
def test_unknown_name_is_refused_with_those_that_are_known(
    emulator: EmulatorProcess, register: str, value: str, expected: str
) -> None:
    with pytest.raises(ConfigError, match=expected):
        call(emulator, "write", "bench_int16", register, value, "--yes")
