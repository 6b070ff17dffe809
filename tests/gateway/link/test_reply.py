"""What counts as the reply. Frames are written out byte by byte from the specification."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.link.reply import Request, check_reply, split
from gateway.reasons import Reason

READ_TWO = Request(transaction=0x0107, unit=1, function=3, length=6)
"""FC3, two registers: a normal PDU is function code, byte count 4, four bytes."""

GOOD = bytes.fromhex("0107 0000 0007 01 03 04 000A 0102")
"""transaction, protocol, length = 7, unit, FC3, byte count 4, register 10, register 258"""


def test_the_specifications_reply_is_taken() -> None:
    assert check_reply(GOOD, READ_TWO) is None


@pytest.mark.parametrize(
    ("received", "reason"),
    [
        ("", Reason.TIMEOUT),
        ("0107 0000 0007 01 03 04 000A 01", Reason.TIMEOUT),  # last byte missing
        ("0108 0000 0007 01 03 04 000A 0102", Reason.WRONG_TRANSACTION),
        ("0000 0000 0007 01 03 04 000A 0102", Reason.WRONG_TRANSACTION),  # id 0
        ("0107 0001 0007 01 03 04 000A 0102", Reason.WRONG_TRANSACTION),  # protocol 1
        ("0107 0000 0007 02 03 04 000A 0102", Reason.WRONG_TRANSACTION),  # unit 2
        ("0107 0000 0007 01 04 04 000A 0102", Reason.WRONG_FUNCTION),
        ("0107 0000 0003 01 84 02", Reason.WRONG_FUNCTION),  # exception to another function
        ("0107 0000 0005 01 03 02 000A", Reason.WRONG_COUNT),  # one register
        ("0107 0000 0009 01 03 06 000A 0102 0000", Reason.WRONG_COUNT),  # three
    ],
)
def test_another_reply_is_refused_with_its_reason(received: str, reason: Reason) -> None:
    rejection = check_reply(bytes.fromhex(received), READ_TWO)
    assert rejection is not None
    assert rejection.reason is reason


@pytest.mark.parametrize("code", range(1, 12))
def test_an_exception_reply_carries_its_code(code: int) -> None:
    rejection = check_reply(bytes.fromhex("0107 0000 0003 01 83") + bytes([code]), READ_TWO)
    assert rejection is not None
    assert rejection.exception == code
    assert not rejection.out_of_sync


def test_a_late_reply_to_a_request_that_was_abandoned_is_passed_over() -> None:
    late = bytes.fromhex("0106 0000 0007 01 03 04 FFFF FFFF")
    assert check_reply(late + GOOD, READ_TWO, {0x0106}) is None


def test_an_old_reply_that_was_not_abandoned_is_refused() -> None:
    twice = bytes.fromhex("0106 0000 0007 01 03 04 FFFF FFFF") + GOOD
    rejection = check_reply(twice, READ_TWO)
    assert rejection is not None
    assert rejection.out_of_sync


def test_bytes_after_the_reply_put_the_connection_out_of_sync() -> None:
    rejection = check_reply(GOOD + b"\x00", READ_TWO)
    assert rejection is not None
    assert rejection.out_of_sync


@given(st.binary(max_size=600))
def test_any_bytes_split_into_frames_and_a_rest_that_make_them_up(received: bytes) -> None:
    frames, rest = split(received)
    headers = 7 * len(frames)
    assert headers + sum(len(found.pdu) for found in frames) + len(rest) == len(received)


@given(st.binary(max_size=300))
def test_only_the_exact_frame_is_taken(received: bytes) -> None:
    taken = check_reply(received, READ_TWO) is None
    assert taken == (received[:8] == GOOD[:8] and len(received) == len(GOOD))
