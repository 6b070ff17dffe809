"""A whole run over Modbus/TCP Security: the emulator behind a TLS proxy, both with certificates."""

import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from gateway.recordings.recording import read
from plant_emulator.emulator.process import EmulatorProcess
from tests.gateway.certificates import certificates, server_context
from tests.gateway.fault_proxy import whole_frame
from tests.system.gateway_process import gateway, until, until_armed

pytestmark = [pytest.mark.slow, pytest.mark.realtime, pytest.mark.peer]


@contextmanager
def secured(context: ssl.SSLContext, port: int) -> Iterator[tuple[int, list[object]]]:
    """Port of a TLS proxy before a plain PLC, and the subjects of its clients' certificates.

    It passes a request on, then its reply: an object of OpenSSL belongs to one thread.
    """
    subjects: list[object] = []

    def serve() -> None:
        while True:
            with suppress(OSError):
                raw, _ = listener.accept()
                raw.settimeout(5.0)
                with (
                    context.wrap_socket(raw, server_side=True) as client,
                    socket.create_connection(("127.0.0.1", port), 5.0) as plc,
                ):
                    subjects.append((client.getpeercert() or {}).get("subject"))
                    while received := client.recv(300):
                        plc.sendall(received)
                        client.sendall(whole_frame(plc))
            if listener.fileno() < 0 or ended.is_set():
                return

    ended = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        try:
            yield listener.getsockname()[1], subjects
        finally:
            ended.set()
            listener.shutdown(socket.SHUT_RDWR)
    thread.join(10.0)


def test_run_over_tls_starts_drives_and_ends_as_a_plain_one(
    tmp_path: Path, require_program: Callable[[str], str]
) -> None:
    folder = certificates(tmp_path, require_program("openssl"))
    files = {
        "authority": "plant.pem",
        "certificate": "plant_gateway.pem",
        "key": "plant_gateway.key",
    }
    options = [
        word for key, name in files.items() for word in ("--set", f"plc.tls_{key}={folder / name}")
    ]
    with (
        EmulatorProcess(driver="pi") as emulator,
        secured(server_context(folder), emulator.port) as (port, subjects),
        gateway(tmp_path, port, *options) as daemon,
    ):
        until_armed(emulator)
        emulator.set_remote(on=True)
        until(lambda: emulator.status()["motor_speed"] > 100.0)
        assert daemon.stop() == 0
        assert emulator.status()["alarms"] == []
        assert emulator.status()["speed_reference"] == 0.0
    assert subjects == [((("commonName", "gateway"),),)]
    assert daemon.passed() == ["CONNECT", "SHADOW", "ARMED", "RUN", "RAMPDOWN", "SAFE", "OFF"]
    records = read(next((tmp_path / "recordings").glob("*.rlrec"))).records
    assert records["dropped"].max() == 0
