"""Modbus/TCP Security against a TLS server on the loopback, with certificates of this test."""

import re
import ssl
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from socket import create_server

import pytest

from gateway.configuration.config import Config, from_document
from gateway.errors import ConfigError
from gateway.link import tls
from gateway.link.plc import LinkError, TcpLink
from gateway.reasons import Reason
from register_maps.register_map import Block
from tests.gateway.certificates import certificates, server_context
from tests.gateway.peer import Request, normal

pytestmark = pytest.mark.peer

PROBE = Block(table="holding", start=0, count=2)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, require_program: Callable[[str], str]) -> Path:
    return certificates(tmp_path_factory.mktemp("certificates"), require_program("openssl"))


def config(folder: Path, authority: str = "plant", own: str = "plant") -> Config:
    return Config().with_values(
        {
            "plc.tls_authority": str(folder / f"{authority}.pem"),
            "plc.tls_certificate": str(folder / f"{own}_gateway.pem"),
            "plc.tls_key": str(folder / f"{own}_gateway.key"),
        }
    )


@contextmanager
def secured_plc(folder: Path, *, pieces: bool = False) -> Iterator[int]:
    """Port of a PLC behind TLS that wants a certificate of the authority `plant`.

    pieces : it sends its reply in two TLS records
    """
    context = server_context(folder)

    def serve() -> None:
        while True:
            try:
                raw, _ = listener.accept()
                raw.settimeout(5.0)
                with context.wrap_socket(raw, server_side=True) as connection:
                    while received := connection.recv(300):
                        asked = Request(
                            transaction=int.from_bytes(received[:2], "big"),
                            unit=received[6],
                            function=received[7],
                            data=received[8:],
                        )
                        reply = normal(asked)
                        cut = 5 if pieces else len(reply)
                        connection.sendall(reply[:cut])
                        connection.sendall(reply[cut:])
            except OSError:
                if listener.fileno() < 0:
                    return

    with create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield listener.getsockname()[1]
        listener.shutdown(2)
    thread.join(5.0)


def link_to(port: int, context: ssl.SSLContext | None) -> TcpLink:
    return TcpLink("127.0.0.1", port, 1, 1.0, settle=5.0, probe=PROBE, tls=context)


def said_by(link: TcpLink, words: str) -> LinkError | None:
    """Connect as the loop does; None: connected, else the error with these words."""
    deadline = time.monotonic() + 10.0
    while True:
        try:
            return link.connect()
        except LinkError as error:
            if re.search(words, str(error)):
                return error
            assert time.monotonic() < deadline, error
            time.sleep(0.001)


@pytest.mark.parametrize("pieces", [False, True])
def test_registers_are_read_and_written_through_tls(folder: Path, *, pieces: bool) -> None:
    with secured_plc(folder, pieces=pieces) as port:
        link = link_to(port, tls.context(config(folder).plc))
        assert said_by(link, "never said") is None
        for start in range(20):
            assert link.read(start, 3) == (100 + start, 101 + start, 102 + start)
            link.write(64, [1, 2])
        link.close()


@pytest.mark.parametrize(
    ("authority", "own", "words"),
    [
        ("other", "plant", "certificate verify failed"),
        ("plant", "other", "unknown ca|closed by the peer|reset by peer|EOF occurred"),
    ],
    ids=["PLC of another authority", "gateway of another authority"],
)
def test_certificate_of_another_authority_gives_no_connection(
    folder: Path, authority: str, own: str, words: str
) -> None:
    with secured_plc(folder) as port:
        link = link_to(port, tls.context(config(folder, authority, own).plc))
        found = said_by(link, words)
        assert found is not None
        assert found.reason is Reason.NOT_CONNECTED
        link.close()


def test_plc_that_is_not_the_configured_host_gives_no_connection(folder: Path) -> None:
    with secured_plc(folder) as port:
        link = TcpLink("localhost", port, 1, 1.0, tls=tls.context(config(folder).plc))
        assert "certificate verify failed" in str(said_by(link, "certificate verify failed"))
        link.close()


def test_plain_client_gets_no_register_of_a_secured_plc(folder: Path) -> None:
    with secured_plc(folder) as port:
        link = link_to(port, None)
        assert said_by(link, "closed by the peer|reset by peer") is not None
        link.close()


def test_connecting_does_not_wait_for_a_handshake() -> None:
    with create_server(("127.0.0.1", 0)) as silent:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        link = link_to(silent.getsockname()[1], context)
        begun = time.monotonic()
        for _ in range(50):
            with pytest.raises(LinkError):
                link.connect()
        assert time.monotonic() - begun < 0.5
        link.close()


def test_without_files_the_connection_is_plain() -> None:
    assert tls.context(Config().plc) is None


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"plc.tls_key": None}, r"\[plc\] tls_key: missing.*all three"),
        ({"plc.tls_authority": "no.pem"}, r"\[plc\] tls_authority: No such file.*'no.pem'"),
        ({"plc.tls_key": "other_gateway.key"}, r"\[plc\] tls_certificate, tls_key: .*belong"),
    ],
)
def test_files_that_are_missing_or_do_not_belong_together_are_told(
    folder: Path, changed: dict[str, str | None], says: str
) -> None:
    document = config(folder).document
    for key, name in changed.items():
        path = str(folder / str(name)) if name and name != "no.pem" else name
        document["plc"][key.removeprefix("plc.")] = path
        if path is None:
            del document["plc"][key.removeprefix("plc.")]
    with pytest.raises(ConfigError, match=says):
        tls.context(from_document(document).plc)
