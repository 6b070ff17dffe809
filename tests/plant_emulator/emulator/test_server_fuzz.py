"""Mutated requests to the server: no register changes but by a whole and right write."""

import contextlib
import random

import pytest

from tests.plant_emulator.emulator.test_server import IMAGE, Served, adu

SILENCE = 0.01
"""[s] Time in which a reply to what is no write would come; most of it gets none."""
GOOD = adu("10 0040 0002 04 0001 0002")
IMAGE_READ = "03 40 " + b"".join(word.to_bytes(2, "big") for word in IMAGE).hex(" ", 1).upper()


def mutant(chance: random.Random) -> bytes:
    made = bytearray(GOOD)
    for _ in range(chance.randint(1, 3)):
        at = chance.randrange(len(made))
        made[at : at + 1] = chance.choice((b"", chance.randbytes(1), chance.randbytes(3)))
    return bytes(made)


def writes(made: bytes) -> bool:
    """Whether the first frame is a write to the command block, after the specification."""
    length = int.from_bytes(made[4:6], "big")
    pdu = made[7 : 6 + length]
    address, count = int.from_bytes(pdu[1:3], "big"), int.from_bytes(pdu[3:5], "big")
    if made[2:4] != b"\0\0" or len(made) < 6 + length or not pdu:
        return False
    if pdu[0] == 6:
        return len(pdu) == 5 and 64 <= address < 80
    right = len(pdu) == 6 + 2 * count and pdu[5:6] == bytes([2 * count % 256])
    return pdu[0] == 16 and count > 0 and right and 64 <= address <= 80 - count


@pytest.mark.slow
def test_mutated_write_changes_the_command_only_where_it_is_one():
    served, chance, written = Served(), random.Random(3), 0
    try:
        for number in range(1000):
            made = mutant(chance)
            with served.connect() as wire:
                wire.sendall(made)
                wire.settimeout(10.0 if writes(made) else SILENCE)
                with contextlib.suppress(OSError):
                    wire.recv(100)
            changed = served.plc.command is not None
            assert changed == writes(made), made.hex(" ")
            written += changed
            served.plc.command = None
            if number % 100 == 0:
                assert served.ask("03 0000 0020") == IMAGE_READ
    finally:
        served.stop()
    assert 100 < written < 900
