"""Mutated replies: only a reply whose frame is whole and right is taken, word for word.

The oracle is written from the specification: a right reply differs from the good one in its
registers only. No checksum of Modbus TCP guards these; TCP does.
"""

import random
from collections.abc import Iterator

import pytest

from gateway.link.plc import LinkError, TcpLink
from gateway.link.reply import Request, check_reply
from tests.gateway.peer import Request as Asked
from tests.gateway.peer import frame, peer

pytestmark = pytest.mark.slow

COUNT = 8
FRAME, FIXED = 8, 9
"""Bytes of MBAP header and function code; the same with the byte count, before the registers."""


def good(transaction: int) -> bytes:
    return frame(transaction, 1, bytes([3, 2 * COUNT]) + bytes(range(2 * COUNT)))


def mutant(chance: random.Random, reply: bytes) -> bytes:
    """Reply after one to three changes: bits, bytes, cuts, insertions, repetitions."""
    made = bytearray(reply)
    for _ in range(chance.randint(1, 3)):
        at = chance.randrange(len(made)) if made else 0
        kind = chance.randrange(6)
        if kind == 0 and made:
            made[at] ^= 1 << chance.randrange(8)
        elif kind == 1 and made:
            made[at] = chance.choice((0, 1, 3, 0x7F, 0x80, 0x83, 0xFF))
        elif kind == 2:
            del made[at : at + chance.randint(1, 4)]
        elif kind == 3:
            made[at:at] = chance.randbytes(chance.randint(1, 4))
        elif kind == 4:
            made += made[at:]
        else:
            made = made[: max(at, 1)]
    return bytes(made)


def is_right(reply: bytes, made: bytes, fixed: int) -> bool:
    return len(made) == len(reply) and made[:fixed] == reply[:fixed]


def mutants(seed: int, count: int) -> Iterator[bytes]:
    chance = random.Random(seed)
    return (mutant(chance, good(7)) for _ in range(count))


def test_of_100_000_mutated_replies_those_are_taken_whose_frame_is_right() -> None:
    """The link compares the byte count, see below."""
    request = Request(transaction=7, unit=1, function=3, length=2 + 2 * COUNT)
    taken = 0
    for made in mutants(1, 100_000):
        accepted = check_reply(made, request) is None
        assert accepted == is_right(good(7), made, FRAME), made.hex(" ")
        taken += accepted
    assert 1_000 < taken < 50_000


def test_link_gives_the_words_of_a_right_reply_and_an_error_for_any_other() -> None:
    chance, now = random.Random(2), [0.0]
    sent: list[tuple[bytes, bytes]] = []

    def answer(request: Asked) -> bytes:
        reply = good(request.transaction)
        sent.append((reply, mutant(chance, reply)))
        return sent[-1][1]

    with peer(answer) as running:
        link = TcpLink("127.0.0.1", running.port, 1, 0.005, clock=lambda: now[0])
        words = errors = 0
        while words + errors < 2_000:
            now[0] += 10.0  # what was given up is closed, and the next attempt is due
            try:
                link.connect()
            except LinkError:
                continue
            try:
                found = link.read(0, COUNT)
            except LinkError:
                errors += 1
                continue
            words += 1
            reply, made = sent[-1]
            assert is_right(reply, made, FIXED), made.hex(" ")
            assert b"".join(word.to_bytes(2, "big") for word in found) == made[FIXED:]
        link.close()
    assert words > 50
    assert errors > 1_000
