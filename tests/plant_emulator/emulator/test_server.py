"""The Modbus server, byte by byte, against frames of the Modbus specification."""

import asyncio
import contextlib
import random
import socket
import threading

import pytest

from plant_emulator.emulator.server import PlcServer, PortError
from register_maps import load

INT16 = load("bench_int16")
IMAGE = tuple(range(1000, 1032))


class Served:
    """A server with its own event loop and thread."""

    def __init__(self) -> None:
        self.loop = asyncio.new_event_loop()
        self.thread = threading.Thread(target=self.loop.run_forever)
        self.thread.start()
        self.plc = PlcServer(INT16, "127.0.0.1", 0)
        self.plc.image = IMAGE
        self.do(self.plc.start())

    def do(self, work):
        return asyncio.run_coroutine_threadsafe(work, self.loop).result(10)

    def stop(self) -> None:
        self.do(self.plc.stop())
        self.do(asyncio.sleep(0))
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join()
        self.loop.close()

    def apply_faults(self, *names: str) -> None:
        self.do(self.plc.apply_faults(frozenset(names)))

    def connect(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.plc.port), timeout=10)

    def ask(self, pdu: str, unit: int = 1) -> str:
        """Send a request and return its reply, both without their MBAP headers."""
        with self.connect() as wire:
            wire.sendall(adu(pdu, unit))
            header = received(wire, 7)
            assert header[:4] == b"\x12\x34\0\0"
            assert header[6] == unit
            return received(wire, int.from_bytes(header[4:6], "big") - 1).hex(" ", 1).upper()


def adu(pdu: str, unit: int = 1) -> bytes:
    data = bytes.fromhex(pdu)
    return b"\x12\x34\0\0" + (len(data) + 1).to_bytes(2, "big") + bytes([unit]) + data


def received(wire: socket.socket, count: int) -> bytes:
    data = b""
    while len(data) < count and (more := wire.recv(count - len(data))):
        data += more
    return data


def remaining(wire: socket.socket) -> bytes:
    """All bytes that arrive after we closed our side."""
    wire.shutdown(socket.SHUT_WR)
    return received(wire, 1000)


@pytest.fixture
def served():
    made = Served()
    yield made
    made.stop()


@pytest.mark.parametrize("function", ["03", "04"])
def test_block_is_read_as_holding_and_as_input_registers(served, function):
    #                          fc  address quantity        fc         bytes first register
    assert served.ask(f"{function} 0000    0020").startswith(f"{function} 40 03 E8 03 E9")


def test_part_of_the_block_is_read_from_its_address(served):
    assert served.ask("03 001F 0001") == "03 02 04 07"


@pytest.mark.parametrize("unit", [0, 1, 17, 255])
def test_every_unit_shows_the_same_and_is_written_the_same(served, unit):
    assert served.ask("03 0000 0001", unit) == "03 02 03 E8"
    assert served.ask("06 0044 1234", unit) == "06 00 44 12 34"
    assert served.ask("03 0044 0001", 255 - unit) == "03 02 12 34"


def test_nothing_is_commanded_before_the_first_write(served):
    served.ask("03 0040 0010")
    assert served.plc.command is None


def test_write_of_one_register_leaves_the_others(served):
    assert served.ask("06 0041 ABCD") == "06 00 41 AB CD"
    assert served.plc.command == (0, 0xABCD) + (0,) * 14


def test_write_of_the_block_is_one_command(served):
    #                  fc start quantity bytes
    words = "0001 0002 0003 0004 0005 0006 0007 0008 0009 000A 000B 000C 000D 000E 000F 0010"
    assert served.ask(f"10 0040 0010 20 {words}") == "10 00 40 00 10"
    assert served.plc.command == tuple(range(1, 17))


def test_function_23_writes_and_reads(served):
    #                  fc read at count write at count bytes words
    reply = served.ask("17 0000    0002  0042     0001  02    0007")
    assert reply == "17 04 03 E8 03 E9"
    assert served.plc.command[2] == 7


@pytest.mark.parametrize(
    "write",
    [
        "06 0000 0001",
        "06 003F 0001",
        "06 0050 0001",
        "10 003F 0002 04 0001 0001",
        "10 004F 0002 04 0001 0001",
        "10 001F 0001 02 0001",
    ],
)
def test_write_outside_the_command_block_is_exception_2_and_has_no_effect(served, write):
    assert served.ask(write) == f"{int(write[:2], 16) | 0x80:02X} 02"
    assert served.plc.command is None


@pytest.mark.parametrize("read", ["03 0020 0001", "03 0000 0041", "03 0051 0001", "04 0400 0001"])
def test_read_of_what_is_not_there_is_exception_2(served, read):
    assert served.ask(read) == f"{int(read[:2], 16) | 0x80:02X} 02"


@pytest.mark.parametrize(
    "pdu",
    ["01 0000 0010", "02 0000 0010", "05 0040 FF00", "0F 0040 0001 01 01", "16 0040 00FF 0001"],
)
def test_other_functions_are_exception_1_and_have_no_effect(served, pdu):
    assert served.ask(pdu) == f"{int(pdu[:2], 16) | 0x80:02X} 01"
    assert served.plc.command is None


def test_no_reply_is_torn_while_the_image_is_replaced(served):
    stop = threading.Event()

    def replace() -> None:
        number = 0
        while not stop.is_set():
            number = (number + 1) % 65536
            served.plc.image = (number,) * 32

    thread = threading.Thread(target=replace)
    thread.start()
    try:
        with served.connect() as wire:
            for _ in range(200):
                wire.sendall(adu("03 0000 0020"))
                words = received(wire, 9 + 64)[9:]
                assert words in (words[:2] * 32, b"".join(n.to_bytes(2, "big") for n in IMAGE))
    finally:
        stop.set()
        thread.join()


def test_taken_port_is_named_in_our_words_only(served, capfd):
    second = PlcServer(INT16, "127.0.0.1", served.plc.port)
    with pytest.raises(PortError, match=f"127.0.0.1:{served.plc.port}") as refused:
        served.do(second.start())
    assert refused.value.exit_code == 2
    assert "Address already in use; take another --port" in str(refused.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("host", ["nowhere.invalid", "a..b", "192.0.2.1"])
def test_host_of_another_machine_is_distinguished_from_a_busy_port(served, host):
    with pytest.raises(PortError, match=f"{host}.*a --host that is an address") as refused:
        served.do(PlcServer(INT16, host, 0).start())
    assert "--port" not in str(refused.value)


def test_refused_connection_cuts_the_old_ones_and_comes_back_on_the_same_port(served):
    port = served.plc.port
    with served.connect() as wire:
        wire.sendall(adu("03 0000 0001"))
        received(wire, 11)
        served.apply_faults("refuse_connection")
        with contextlib.suppress(ConnectionResetError):
            assert wire.recv(1) == b""
    with pytest.raises(ConnectionRefusedError):
        served.connect()
    served.apply_faults()
    assert served.plc.port == port
    assert served.ask("03 0000 0001") == "03 02 03 E8"


def test_excepted_write_has_no_effect(served):
    served.apply_faults("exception_6")
    assert served.ask("06 0041 0001") == "86 06"
    assert served.plc.command is None


def test_drop_mid_reply_ends_the_connection_after_a_part(served):
    served.apply_faults("drop_mid_reply")
    with served.connect() as wire:
        wire.sendall(adu("03 0000 0002"))
        assert received(wire, 100) == adu("03 04 03E8 03E9")[:6]


def test_late_reply_comes_whole_and_the_connection_lives(served):
    served.apply_faults("late_reply")
    assert served.ask("03 0000 0001") == "03 02 03 E8"
    served.apply_faults()
    assert served.ask("03 0000 0001") == "03 02 03 E8"


def test_wrong_transaction_is_on_the_wire(served):
    served.apply_faults("wrong_transaction")
    with served.connect() as wire:
        wire.sendall(adu("03 0000 0001"))
        assert received(wire, 11)[:2] == b"\x12\x35"


def test_faults_may_change_faster_than_the_port_can(served):
    async def flicker() -> None:
        changes = [frozenset({"refuse_connection"}), frozenset()] * 10
        await asyncio.gather(*(served.plc.apply_faults(names) for names in changes))

    served.do(flicker())
    assert served.ask("03 0000 0001") == "03 02 03 E8"


def test_server_outlives_any_bytes(served):
    chance = random.Random(2)
    for length in (1, 7, 8, 12, 260, 600):
        with served.connect() as wire:
            wire.sendall(chance.randbytes(length))
            with contextlib.suppress(ConnectionError):
                remaining(wire)
    assert served.ask("03 0000 0001") == "03 02 03 E8"
    assert served.plc.command is None


# Deviations of pymodbus from the specification. An upgrade that changes one shows here.


def test_known_deviation_three_requests_in_one_segment_get_one_reply(served):
    with served.connect() as wire:
        wire.sendall(3 * adu("03 0000 0001"))
        assert received(wire, 11) == adu("03 02 03E8")
        assert remaining(wire) == b""


def test_known_deviation_126_registers_are_refused_under_function_80(served):
    # specification: 83 03
    assert served.ask("03 0000 007E") == "80 01"


def test_known_deviation_unknown_function_is_refused_under_function_80(served):
    # specification: C4 01
    assert served.ask("44 0000") == "80 01"


def test_known_deviation_foreign_protocol_id_is_not_answered(served):
    with served.connect() as wire:
        wire.sendall(b"\x12\x34\0\1" + adu("03 0000 0001")[4:])
        assert remaining(wire) == b""
