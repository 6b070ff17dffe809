"""The operator's way to a serving emulator: a socket in a file, named after the Modbus port.

A line is a request of `control_channel.py`, the next line its answer. Only the user who started the
emulator may open the socket.
"""

import asyncio
import contextlib
import json
import os
import socket
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from plant_emulator.emulator.control_channel import ControlChannel
from plant_emulator.errors import EmulatorError

TIMEOUT = 30.0


class OperatorError(EmulatorError):
    """No emulator serves this port, or it refuses the request."""


def socket_path(port: int) -> Path:
    """File of the socket of the emulator at this port."""
    return Path(tempfile.gettempdir()) / f"plant-emulator-{os.getuid()}-{port}.sock"


@asynccontextmanager
async def serve_operator(channel: ControlChannel, port: int) -> AsyncIterator[None]:
    """Answer the operator inside the block."""

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.closing(writer):
            while line := await reader.readline():
                writer.write(channel.answer(line.decode()).encode() + b"\n")
                await writer.drain()

    path = socket_path(port)
    path.unlink(missing_ok=True)  # of an emulator that was killed: the port is ours now
    mask = os.umask(0o177)
    try:
        server = await asyncio.start_unix_server(answer, path)
    finally:
        os.umask(mask)
    try:
        yield
    finally:
        server.close()
        path.unlink(missing_ok=True)


def ask(port: int, **request: Any) -> Any:
    """Answer of the emulator at this port to a request. Raises OperatorError."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(TIMEOUT)
        try:
            connection.connect(str(socket_path(port)))
            connection.sendall(json.dumps(request).encode() + b"\n")
            with connection.makefile() as answers:
                answer = json.loads(answers.readline())
        except (OSError, ValueError) as error:
            raise OperatorError(
                f"port {port}: no emulator of yours serves it; expected the --port of a running "
                "`plant-emulator serve`"
            ) from error
    if "error" in answer:
        raise OperatorError(f"port {port}: {answer['error']}")
    return answer["ok"]
