"""Bad input of the gateway's own: one line that names it, exit code 2, nothing begun."""

import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import register_maps
from gateway.cli import main
from gateway.cli.registers import command as registers
from gateway.errors import ConfigError, PlcError
from gateway.link.connector import resolve
from gateway.link.device import encode_scaled
from plant_emulator import logs
from plant_emulator.signals.log import Log

PROGRAM3 = Path(__file__).parents[2] / "data" / "bench_nominal" / "program3.csv.gz"


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def said(result: Result) -> str:
    """The one line of a refusal."""
    assert result.exit_code == 2, result.output
    (line,) = result.stderr.splitlines()
    return line.removeprefix("error: ")


@pytest.mark.parametrize("name", ["a" * 300, "b\u00fccher..de", "a..b", "a\0b"])
def test_what_cannot_be_the_name_of_a_host_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match=r"\[plc\] host.*expected an address"):
        resolve(name, 5020)


def test_a_live_check_of_such_a_host_is_one_line(tmp_path: Path) -> None:
    config = tmp_path / "bench.toml"
    config.write_text("[plc]\nhost = 'a..b'\n")
    assert "'a..b'" in said(run("check", "-c", config, "--live"))


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ("truck.mass_kg=" + 5000 * "9", "a number of too many digits"),
        ("truck.mass_kg=" + 5000 * "[", "nested too deep"),
        ("truck.mass_kg=1\nload_kg=2", "expected one line of text"),
        ("plc.map=", "plc.map: empty"),
        ('plc.map="a\\u0000b"', "plc.map: control character"),
        ('regulator.friction="a\\u0000b"', "regulator.friction: control character"),
        ("regulator.friction=", "regulator.friction: empty"),
    ],
)
def test_a_set_value_that_is_none_is_refused(tmp_path: Path, value: str, told: str) -> None:
    config = tmp_path / "bench.toml"
    config.write_text("")
    assert told in said(run("check", "-c", config, "--set", value))


def test_an_empty_name_of_a_map_is_called_empty() -> None:
    assert "an empty name" in said(run("registers", "list", ""))


@pytest.mark.parametrize(
    ("name", "value"), [("CTRL", 1.5), ("MODE", 2.5), ("HB_GW", 0.1), ("CTRL", float("nan"))]
)
def test_no_bits_state_or_counter_is_rounded(name: str, value: float) -> None:
    register = next(r for r in register_maps.load("bench_int16").registers if r.name == name)
    with pytest.raises(ConfigError, match=f"{name}.*{value}.*whole number"):
        encode_scaled(register, value)


@pytest.fixture
def silent() -> Iterator[int]:
    """The port of a peer that accepts every connection and never says a word."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        kept: list[socket.socket] = []
        server.settimeout(0.05)
        over = threading.Event()

        def accept() -> None:
            while not over.is_set():
                try:
                    kept.append(server.accept()[0])
                except TimeoutError:
                    continue

        thread = threading.Thread(target=accept)
        thread.start()
        yield server.getsockname()[1]
        over.set()
        thread.join()
        for connection in kept:
            connection.close()


def test_a_device_of_which_no_register_answers_is_a_failure(silent: int) -> None:
    with pytest.raises(PlcError, match=f"127.0.0.1:{silent}, unit 7: no register") as failed:
        CliRunner().invoke(
            registers,
            ["read", "bench_int16", "--port", str(silent), "--unit", "7", "--timeout", "0.005"],
            standalone_mode=False,
            catch_exceptions=False,
        )
    assert failed.value.exit_code == 1


@pytest.mark.parametrize(("sign", "warned"), [(1.0, False), (-1.0, True)])
def test_replay_warns_of_a_torque_of_the_wrong_sign(
    tmp_path: Path, sign: float, warned: bool
) -> None:
    log = logs.read(PROGRAM3)
    path = tmp_path / "run.csv"
    torque = {"shaft_torque": sign * log["shaft_torque"]}
    logs.write(Log(log.time, {**log.signals, **torque}), path)
    result = run("replay", path)
    assert result.exit_code == 0
    assert (f"warning: {path}: the sign of the shaft torque is wrong" in result.stderr) == warned


@pytest.mark.parametrize(
    ("scale", "told"), [(1e-9, "a sample every 1e-11 s"), (1e9, "a sample every 1e+07 s")]
)
def test_a_log_sampled_as_no_bench_is_refused(tmp_path: Path, scale: float, told: str) -> None:
    path = tmp_path / "run.csv"
    head = "time_s,speed_reference_rad_s,motor_speed_rad_s,drum_speed_rad_s,shaft_torque_Nm\n"
    times = scale * 0.01 * np.arange(50)
    path.write_text(head + "".join(f"{time!r},0,0,0,0\n" for time in times.tolist()))
    assert said(run("replay", path)).startswith(f"{path}: {told}; expected one every 0.0001 .. 10")
