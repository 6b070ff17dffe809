"""The Modbus TCP server of the PLC. No other module of the emulator imports pymodbus.

Reads are answered from an image that each scan replaces as a whole, so no reply is torn. The server
supports functions 3, 4, 6, 16 and 23. A write outside the command block gets exception 2. The
server answers every unit id, because libmodbus clients use 255 by default.

pymodbus answers one request per segment. It also gives wrong error frames for a bad quantity or an
unknown function. tests/plant_emulator/emulator/test_server.py pins these deviations.
"""

import asyncio
import errno
import logging
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

# pymodbus prints the bytes of a client that talks nonsense; the client sees its answer anyway.
logging.getLogger("pymodbus").setLevel(logging.CRITICAL + 1)


class PortError(EmulatorError):
    """The server cannot listen on its port."""

    exit_code = 2


def refusal(error: OSError | UnicodeError, host: str, port: int) -> str:
    """Why the server cannot listen there, and which option to change."""
    code = getattr(error, "errno", None)
    if code in (errno.EADDRINUSE, errno.EACCES):
        why, right = os.strerror(code), "another --port (0 = any free one)"
    else:
        why = "cannot be a name" if isinstance(error, UnicodeError) else str(error.strerror)
        right = "a --host that is an address or a name of this machine"
    return f"cannot listen on {host}:{port}: {why}; take {right}"


class PlcServer:
    """Serves the two blocks of a register map on a port.

    image : words of the measurement block, as clients read them
    command : words of the command block, as clients wrote them; None before the first write
    Both are tuples that are replaced as a whole, because another thread may replace the image at
    any moment. Call `start`, `stop` and `apply_faults` in the loop's thread.
    """

    def __init__(self, register_map: RegisterMap, host: str, port: int) -> None:
        self.register_map, self.host, self.port = register_map, host, port
        self.image: tuple[int, ...] = (0,) * register_map.measurement.count
        self.command: tuple[int, ...] | None = None
        self.faults: frozenset[str] = frozenset()
        self._listener: _Listener | None = None
        self._changing = asyncio.Lock()

    def blocks(self) -> tuple[tuple[Block, tuple[int, ...]], ...]:
        """The readable blocks with their words."""
        command = self.register_map.command
        return (
            (self.register_map.measurement, self.image),
            (command, self.command or (0,) * command.count),
        )

    async def start(self) -> None:
        """Start to listen and set `port` to the real port. Raises PortError.

        Faults that change meanwhile wait: each of two listeners would want the port.
        """
        async with self._changing:
            await self._listen()

    async def _listen(self) -> None:
        listener = _Listener(self)
        await listener.serve_forever(background=True)
        self._listener = listener
        self.port = listener.bound_port

    async def stop(self) -> None:
        """Stop listening and close every connection."""
        if self._listener is not None:
            await self._listener.shutdown()  # type: ignore[no-untyped-call]  # pymodbus declares none here
            self._listener = None

    async def apply_faults(self, names: frozenset[str]) -> None:
        """Replace the active faults; open or close the port accordingly."""
        self.faults = names
        async with self._changing:
            if faults.refuses(names):
                await self.stop()
            elif self._listener is None:
                await self._listen()

    def request(
        self, function: int, address: int, count: int, values: list[int] | None
    ) -> ExcCodes | None:
        """Carry out a request; return the exception code if it is refused.

        values : words to write; None for a read
        """
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
    """One connection. Every reply passes the active faults."""

    def __init__(self, listener: ModbusTcpServer, plc: PlcServer) -> None:
        super().__init__(listener, None, None, None)  # type: ignore[no-untyped-call]  # pymodbus declares none here
        self.plc = plc

    def send(self, data: bytes, addr: tuple[Any, ...] | None = None) -> None:
        """Send the reply after the active faults changed it."""
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
    """The server of pymodbus with our handler for each connection."""

    def __init__(self, plc: PlcServer) -> None:
        super().__init__(_devices(plc), address=(plc.host, plc.port))
        self.plc = plc
        self._listen, self.call_create = self.call_create, self._listen_or_raise

    async def _listen_or_raise(self) -> Any:
        """Listen or raise PortError, because pymodbus prints an OSError and drops it."""
        try:
            return await self._listen()
        except (OSError, UnicodeError) as error:
            raise PortError(refusal(error, self.plc.host, self.plc.port)) from error

    @property
    def bound_port(self) -> int:
        """Port on which the server listens."""
        listening: Any = self.transport
        return int(listening.sockets[0].getsockname()[1])

    def callback_new_connection(self) -> _Handler:
        """Make the handler of a new connection."""
        return _Handler(self, self.plc)


def _devices(plc: PlcServer) -> list[SimDevice]:
    """Two pymodbus devices with the PLC's registers: one for our unit, one for any other."""

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
