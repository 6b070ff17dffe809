"""The loop behind a fault proxy: each spoiled reply ends RUN with its reason in time, re-armable.

Time is virtual, one tick a scan; only the time-out of the link is real. The rows are those of what
goes wrong between a gateway and a PLC: half-open, late, torn, mixed-up and lying replies.
"""

from collections.abc import Iterator
from pathlib import Path

import pytest

from gateway.cycle.supervisor import State
from gateway.link.plc import TcpLink
from gateway.reasons import Reason
from plant_emulator.emulator.process import EmulatorProcess
from register_maps import load
from tests.gateway.fault_proxy import Proxy, Toxic, proxy, sound
from tests.gateway.peer import Request, frame
from tests.gateway.runtime.test_loop import Run

pytestmark = pytest.mark.slow

MAP = load("bench_int16")
TICKS = 15
"""150 ms until RUN is left."""


def exception(code: int) -> Toxic:
    return lambda request, _: frame(
        request.transaction, request.unit, bytes([request.function | 0x80, code])
    )


def only_reads(toxic: Toxic) -> Toxic:
    return lambda request, reply: toxic(request, reply) if request.function == 3 else reply


def only_writes(toxic: Toxic) -> Toxic:
    return lambda request, reply: toxic(request, reply) if request.function == 16 else reply


def with_word(address: int, word: int) -> Toxic:
    """A reading in which one register shows this word."""
    at = 9 + 2 * address

    def spoiled(_: Request, reply: bytes) -> bytes:
        return reply[:at] + word.to_bytes(2, "big") + reply[at + 2 :]

    return only_reads(spoiled)


ROWS: dict[str, tuple[Toxic, set[Reason]]] = {
    "silent": (lambda request, reply: b"", {Reason.TIMEOUT}),
    "hangs up": (lambda request, reply: None, {Reason.CONNECTION_LOST}),
    "stops in the middle": (lambda request, reply: reply[:-3], {Reason.TIMEOUT}),
    "reply twice": (lambda request, reply: reply + reply, {Reason.WRONG_TRANSACTION}),
    "other transaction": (
        lambda request, reply: frame((request.transaction + 1) % 65536, request.unit, reply[7:]),
        {Reason.WRONG_TRANSACTION},
    ),
    "transaction 0": (
        lambda request, reply: frame(0, request.unit, reply[7:]),
        {Reason.WRONG_TRANSACTION},
    ),
    "other unit": (
        lambda request, reply: frame(request.transaction, 7, reply[7:]),
        {Reason.WRONG_TRANSACTION},
    ),
    "other protocol": (
        lambda request, reply: frame(request.transaction, request.unit, reply[7:], protocol=1),
        {Reason.WRONG_TRANSACTION},
    ),
    "length 65535": (
        lambda request, reply: reply[:4] + b"\xff\xff" + reply[6:],
        {Reason.TIMEOUT},
    ),
    "other function": (
        only_reads(lambda request, reply: reply[:7] + b"\x04" + reply[8:]),
        {Reason.WRONG_FUNCTION},
    ),
    "function 0x80": (
        lambda request, reply: frame(request.transaction, request.unit, b"\x80\x01"),
        {Reason.WRONG_FUNCTION},
    ),
    "fewer registers": (
        only_reads(
            lambda request, reply: frame(
                request.transaction, request.unit, bytes([3, reply[8] - 2]) + reply[9:-2]
            )
        ),
        {Reason.WRONG_COUNT},
    ),
    **{
        f"exception {code}": (exception(code), {Reason[f"EXCEPTION_{code}"]})
        for code in (1, 2, 3, 4, 5, 6, 8, 10, 11)
    },
    "reads refused": (only_reads(exception(6)), {Reason.EXCEPTION_6}),
    "writes refused": (only_writes(exception(2)), {Reason.EXCEPTION_2, Reason.NOT_ECHOED}),
    "program stopped": (with_word(1, 4711), {Reason.HEARTBEAT_FROZEN}),
    "torn image": (with_word(31, 1), {Reason.TORN_IMAGE}),
    "not available": (with_word(8, 0x8000), {Reason.NOT_AVAILABLE}),
    "test word": (with_word(28, 12345), {Reason.TEST_WORD}),
    "motor speed of 6000 rpm": (with_word(8, 30000), {Reason.OVERSPEED}),
}


@pytest.fixture(scope="module")
def emulator() -> Iterator[EmulatorProcess]:
    with EmulatorProcess(speed=None, truck_mass=None) as running:
        yield running


@pytest.fixture
def behind(emulator: EmulatorProcess, tmp_path: Path) -> Iterator[tuple[Run, Proxy]]:
    with proxy(emulator.port) as between:
        run = Run(emulator, tmp_path / "run.rlrec")
        port = between.listening.port
        run.loop._link = run.link = TcpLink(
            "127.0.0.1", port, unit=1, timeout=0.4, settle=5.0, probe=MAP.measurement
        )
        yield run, between
        emulator.set_remote(on=False)
        run.link.close()


def into_run(run: Run) -> None:
    """The operator's way into RUN, from ARMED or from SAFE."""
    for _ in range(8):
        run.bench.emulator.set_remote(on=False)
        run.for_ticks(30)
        run.bench.emulator.set_remote(on=True)
        run.for_ticks(60)
        if run.output.state is State.RUN:
            return
    raise AssertionError(f"not in RUN: {run.output}")


@pytest.mark.parametrize("name", ROWS)
def test_spoiled_reply_ends_the_run_in_time_with_its_reason_and_can_be_armed_again(
    behind: tuple[Run, Proxy], name: str
) -> None:
    run, between = behind
    between.toxic = sound
    into_run(run)
    between.toxic, reasons = ROWS[name]
    run.into(State.RAMPDOWN, TICKS)
    assert run.output.reason in reasons
    run.into(State.SAFE, 200)
    between.toxic = sound
    into_run(run)


def test_reply_in_single_bytes_and_a_late_one_are_borne(behind: tuple[Run, Proxy]) -> None:
    """One lost reply comes before the next one."""
    run, between = behind
    into_run(run)
    kept: list[bytes] = []

    def late_once(_: Request, reply: bytes) -> bytes:
        kept.append(reply)
        return b"" if len(kept) == 1 else (kept[0] + reply if len(kept) == 2 else reply)

    between.toxic = late_once
    run.for_ticks(20)
    assert run.output.state is State.RUN
