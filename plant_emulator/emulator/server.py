"""The Modbus TCP server in front of the PLC: the only place that knows pymodbus' server.

Reads are answered from an image that is replaced as a whole once a scan, so no reply is ever torn.
Functions 3, 4, 6, 16 and 23 are served; a write that touches anything but the command block is
answered by exception 2. Every unit id is answered (libmodbus clients ask for 255 by default).

pymodbus answers one request a segment and gives wrong error frames for a bad quantity or an unknown
function; tests/plant_emulator/emulator/test_server.py pins these deviations.
"""

import asyncio
import errno
import os
from typing import Any

from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.server.requesthandler import ServerRequestHandler
from pymodbus.simulator import DataType, SimData, SimDevice

from plant_emulator.emulator.plc import faults
from plant_emulator.errors import EmulatorError
from register_maps.register_map import Block, RegisterMap

READS, WRITES = (3, 4), (6, 16)
READ_WRITE = 23
SERVED = (*READS, *WRITES, READ_WRITE)
UNIT, ANY_UNIT = 1, 0


class PortError(EmulatorError):
    """The port cannot be listened on."""

    exit_code = 2


def refusal(error: OSError | UnicodeError, host: str, port: int) -> str:
    """Why nobody can listen there, and which of the two options to change."""
    code = getattr(error, "errno", None)
    if code in (errno.EADDRINUSE, errno.EACCES):
        why, right = os.strerror(code), "another --port (0 = any free one)"
    else:
        why = "cannot be a name" if isinstance(error, UnicodeError) else str(error.strerror)
        right = "a --host that is an address or a name of this machine"
    return f"cannot listen on {host}:{port}: {why}; take {right}"


class PlcServer:
    """A register map's two blocks on a port.

    `image` (shown) and `command` (written by clients, None until then) are tuples that are
    replaced, never changed: another thread may replace the image at any moment.
    `start`, `stop` and `misbehave` belong to the loop's thread.
    """

    def __init__(self, register_map: RegisterMap, host: str, port: int) -> None:
        self.register_map, self.host, self.port = register_map, host, port
        self.image: tuple[int, ...] = (0,) * register_map.measurement.count
        self.command: tuple[int, ...] | None = None
        self.faults: frozenset[str] = frozenset()
        self._listener: _Listener | None = None
        self._changing = asyncio.Lock()

    def blocks(self) -> tuple[tuple[Block, tuple[int, ...]], ...]:
        """What can be read: each block and its words."""
        command = self.register_map.command
        return (
            (self.register_map.measurement, self.image),
            (command, self.command or (0,) * command.count),
        )

    async def start(self) -> None:
        """Listen; afterwards `port` is the real one."""
        listener = _Listener(self)
        await listener.serve_forever(background=True)
        self._listener = listener
        self.port = listener.bound_port

    async def stop(self) -> None:
        """Stop listening and close every connection."""
        if self._listener is not None:
            await self._listener.shutdown()  # type: ignore[no-untyped-call]  # pymodbus declares none here
            self._listener = None

    async def misbehave(self, names: frozenset[str]) -> None:
        """Switch to exactly these faults."""
        self.faults = names
        async with self._changing:
            if faults.refuses(names):
                await self.stop()
            elif self._listener is None:
                await self.start()

    def request(
        self, function: int, address: int, count: int, values: list[int] | None
    ) -> ExcCodes | None:
        """Carry out a request, values = None for a read; the exception code if it may not be."""
        if faults.refuses_requests(self.faults):
            return ExcCodes.DEVICE_FAILURE
        if function not in SERVED:
            return ExcCodes.ILLEGAL_FUNCTION
        return None if values is None else self._write(address, count, values)

    def _write(self, address: int, count: int, values: list[int]) -> ExcCodes | None:
        block = self.register_map.command
        if not (block.start <= address and address + count <= block.end):
            return ExcCodes.ILLEGAL_ADDRESS
        words = list(self.command or (0,) * block.count)
        words[address - block.start : address - block.start + count] = values
        self.command = tuple(words)
        return None


class _Handler(ServerRequestHandler):
    """One connection. What leaves it passes the faults first."""

    def __init__(self, listener: ModbusTcpServer, plc: PlcServer) -> None:
        super().__init__(listener, None, None, None)  # type: ignore[no-untyped-call]  # pymodbus declares none here
        self.plc = plc

    def send(self, data: bytes, addr: tuple[Any, ...] | None = None) -> None:
        """Send the reply, or what the faults make of it."""
        if not self.plc.faults:
            super().send(data, addr)
            return
        for chunk in faults.reply(self.plc.faults, data):
            if chunk.delay:
                self.loop.call_later(chunk.delay, self._put, chunk.data)
            else:
                self._put(chunk.data)

    def _put(self, data: bytes | None) -> None:
        if data is None:
            self.close()
        elif self.is_active():
            super().send(data)


class _Listener(ModbusTcpServer):
    """pymodbus' server over the device, with our handler for each connection."""

    def __init__(self, plc: PlcServer) -> None:
        super().__init__(_devices(plc), address=(plc.host, plc.port))
        self.plc = plc
        self._listen, self.call_create = self.call_create, self._listens

    async def _listens(self) -> Any:
        """Listen; what stops it becomes ours, since pymodbus prints an OSError and drops it."""
        try:
            return await self._listen()
        except (OSError, UnicodeError) as error:
            raise PortError(refusal(error, self.plc.host, self.plc.port)) from error

    @property
    def bound_port(self) -> int:
        """Port that the system gave us."""
        listening: Any = self.transport
        return int(listening.sockets[0].getsockname()[1])

    def callback_new_connection(self) -> _Handler:
        """Make the handler of one connection."""
        return _Handler(self, self.plc)


def _devices(plc: PlcServer) -> list[SimDevice]:
    """The same registers for our unit and for any other."""

    async def action(
        function: int,
        start: int,
        address: int,
        count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        refused = plc.request(function, address, count, None if values is None else list(values))
        if refused is None:
            for block, words in plc.blocks():
                begin = block.start - start
                registers[begin : begin + block.count] = words
        return refused

    data = [_registers(block) for block, _ in plc.blocks()]
    return [SimDevice(id=unit, simdata=data, action=action) for unit in (UNIT, ANY_UNIT)]


def _registers(block: Block) -> SimData:
    return SimData(address=block.start, count=block.count, values=0, datatype=DataType.REGISTERS)
