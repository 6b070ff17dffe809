"""`plant-emulator operator` turns the switch of a running emulator."""

import stat

import pytest
from click.testing import CliRunner

from plant_emulator.cli.operator import command
from plant_emulator.emulator.operator_socket import OperatorError, socket_path
from plant_emulator.emulator.process import EmulatorProcess

pytestmark = pytest.mark.slow


def call(*arguments: str) -> str:
    result = CliRunner().invoke(
        command, list(arguments), standalone_mode=False, catch_exceptions=False
    )
    return result.output


def test_remote_is_turned_on_and_off() -> None:
    with EmulatorProcess(speed=None, truck_mass=None) as emulator:
        port = str(emulator.port)
        assert call("--remote", "on", "--port", port).startswith("remote on, PLC ")
        emulator.step(1)
        assert emulator.status()["remote"] is True
        call("--remote", "off", "--port", port)
        emulator.step(1)
        assert emulator.status()["remote"] is False
        assert stat.S_IMODE(socket_path(emulator.port).stat().st_mode) & 0o077 == 0
    assert not socket_path(int(port)).exists()


def test_port_without_an_emulator_is_one_line() -> None:
    with pytest.raises(OperatorError, match=r"port 1: no emulator .* expected the --port"):
        call("--remote", "on", "--port", "1")
