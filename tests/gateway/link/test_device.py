"""Registers of a device that lacks some of them: each is read, and the missing ones are named."""

import pytest

from gateway.link.device import Device, read_all
from register_maps import load
from tests.gateway.peer import Answer, Request, frame, normal, peer

MAP = load("bench_int16")
LACKED = {"DRUM_COUNT": 20, "TEST_U32": 29}


def lacking(addresses: set[int], code: int) -> Answer:
    """A PLC that refuses every request for one of these addresses."""

    def answer(request: Request) -> bytes:
        start = int.from_bytes(request.data[:2], "big")
        if addresses & set(range(start, start + request.count)):
            return frame(request.transaction, request.unit, bytes([request.function | 0x80, code]))
        return normal(request)

    return answer


@pytest.mark.parametrize("code", [1, 2, 3])
def test_only_the_registers_that_the_device_lacks_are_unreadable(code: int) -> None:
    with peer(lacking(set(LACKED.values()), code)) as running:
        device = Device(host="127.0.0.1", port=running.port, unit=1, timeout=2.0)
        with device.link() as link:
            reading = read_all(link, MAP)
        assert running.connections == 1
    unreadable = {name for name, found in reading.items() if isinstance(found, str)}
    assert unreadable == set(LACKED)
    assert f"exception {code}" in reading["TEST_U32"]
    assert reading["MOT_SPEED"] == (108,)
    assert len(running.requests) < 25


def test_device_that_refuses_everything_is_told_for_every_register() -> None:
    with peer(lacking(set(range(200)), 2)) as running:
        device = Device(host="127.0.0.1", port=running.port, unit=1, timeout=2.0)
        with device.link() as link:
            reading = read_all(link, MAP)
    assert all("exception 2" in found for found in reading.values())
