"""Web server beside the loop: `/metrics`, `/healthz`, and one page of the present state.

It runs in a process of its own, reads the status block alone and answers GET only. The page loads
nothing from elsewhere.
"""

import json
import re
import socket
import threading
import time
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

from gateway.cycle.supervisor import State
from gateway.errors import ConfigError
from gateway.monitoring import metrics, page, terminal
from gateway.monitoring.block import Snapshot
from gateway.monitoring.lines import reason_text
from gateway.monitoring.shared import Observer
from gateway.reasons import BY_OPERATOR

PLACE: Final = "[metrics] address"
ADDRESS: Final = re.compile(r"(?P<host>\[[0-9a-fA-F:]+\]|[\w.-]+):(?P<port>\d{1,5})")
LAST_PORT: Final = 65535
TIMEOUT: Final = 5.0
"""[s] Time that a client may take for its request."""
LINKED: Final = frozenset({State.SHADOW, State.ARMED, State.RUN})
POLICY: Final = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; "
    "connect-src 'self'; img-src data:; frame-ancestors 'none'; base-uri 'none'"
)
Answer = tuple[HTTPStatus, bytes, str]


def listen(address: str) -> socket.socket:
    """A listening socket at `HOST:PORT`, port 0: any. Raises ConfigError."""
    found = ADDRESS.fullmatch(address)
    if found is None or int(found["port"]) > LAST_PORT:
        raise _bad_address("no address", address)
    host = found["host"].strip("[]")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, int(found["port"])), family=family)
    except OSError as error:
        raise _bad_address(str(error.strerror).partition(" (")[0], address) from error


def _bad_address(why: str, address: str) -> ConfigError:
    expected = "a free HOST:PORT, such as 127.0.0.1:9108"
    return ConfigError(why, place=PLACE, value=address, expected=expected)


def serve(ended: Connection, path: Path, listener: socket.socket) -> None:
    """Process: answer until the daemon's end of the pipe closes."""
    server = make_server(Observer(path), listener)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    ended.poll(None)
    server.shutdown()
    server.server_close()


def make_server(observer: Observer, listener: socket.socket) -> ThreadingHTTPServer:
    """A server on a listening socket."""
    address = listener.getsockname()
    server = ThreadingHTTPServer(address[:2], partial(Handler, observer), bind_and_activate=False)
    server.socket.close()
    server.socket = listener
    server.server_name, server.server_port = address[:2]
    return server


class Handler(BaseHTTPRequestHandler):
    """Answers the requests of one client."""

    timeout = TIMEOUT
    server_version, sys_version = "gateway", ""

    def __init__(self, observer: Observer, *connection: Any) -> None:
        self._observer = observer
        super().__init__(*connection)

    def do_GET(self) -> None:
        """Answer with the page of this path."""
        status, body, kind = answer(self._observer, self.path.partition("?")[0])
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *arguments: Any) -> None:  # noqa: A002 - the base's name
        """Log nothing: a scrape every few seconds is no event."""


def answer(observer: Observer, path: str) -> Answer:
    """Status, body and content type for a path."""
    if path == "/":
        text = resources.files(__package__).joinpath("page.html").read_bytes()
        return HTTPStatus.OK, text, "text/html; charset=utf-8"
    if path not in ("/metrics", "/healthz", "/status.json"):
        return HTTPStatus.NOT_FOUND, b"no such page\n", "text/plain; charset=utf-8"
    snapshot = observer.snapshot()
    age = time.monotonic() - snapshot.values.now
    if path == "/metrics":
        return HTTPStatus.OK, *metrics.exposition(observer.identity, snapshot, age)
    if path == "/healthz":
        return _json(health(snapshot, age), healthy=is_healthy(snapshot, age))
    last = terminal.new_lines(snapshot, snapshot.values.changes - page.LAST)
    rows = page.alarm_rows(snapshot.alarms, terminal.date)
    return _json(page.document(snapshot, age, last, rows) | {"title": observer.identity.title})


def is_healthy(snapshot: Snapshot, age: float) -> bool:
    """Whether the loop ticks, and the PLC answers or the operator ended the run.

    age : of the last tick [s]
    """
    values = snapshot.values
    return age <= page.STALLED and (values.state in LINKED or values.reason in BY_OPERATOR)


def health(snapshot: Snapshot, age: float) -> dict[str, Any]:
    """State and reason; age : of the last tick [s]."""
    return {
        "state": State(snapshot.values.state).name,
        "reason": reason_text(snapshot.values.reason),
        "tick_age": round(age, 3),
    }


def _json(document: dict[str, Any], *, healthy: bool = True) -> Answer:
    status = HTTPStatus.OK if healthy else HTTPStatus.SERVICE_UNAVAILABLE
    return status, json.dumps(document).encode() + b"\n", "application/json"
