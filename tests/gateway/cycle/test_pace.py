"""A PLC too slow for the period is told before a run. Shares by hand: 1 - exp(-t / 0.5 s)."""

import pytest

from gateway.configuration.config import Config
from gateway.cycle import pace
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from tests.gateway.closed_loop import ClosedLoop


def share_after(latency: float, ticks: int, *, writes: bool) -> float:
    share = 0.0
    for _ in range(ticks):
        share = pace.slow(share, latency, writes=writes, period=0.01)
    return share


@pytest.mark.parametrize(
    ("latency", "writes", "slow"),
    [(0.005, False, False), (0.0051, False, True), (0.01, True, False), (0.0101, True, True)],
)
def test_tick_that_only_reads_may_take_half_of_the_period(
    latency: float, writes: bool, slow: bool
) -> None:
    assert (share_after(latency, 1, writes=writes) > 0.0) is slow


def test_share_of_slow_ticks_is_half_after_347_ms() -> None:
    assert pace.reason(share_after(0.02, 34, writes=True)) is None
    assert pace.reason(share_after(0.02, 35, writes=True)) is Reason.TOO_SLOW


def test_single_slow_ticks_do_not_count() -> None:
    share = 0.0
    for tick in range(1000):
        share = pace.slow(share, 0.03 if tick % 4 == 0 else 0.002, writes=True, period=0.01)
    assert pace.reason(share) is None


def test_slow_plc_is_not_armed_for_long_and_never_run():
    loop = ClosedLoop(Config(), latency=0.012)
    loop.run(1.0)
    assert (loop.last.state, loop.last.reason) == (State.SHADOW, Reason.TOO_SLOW)
    loop.operate(remote=True)
    loop.run(1.0)
    assert State.RUN not in {output.state for output in loop.outputs}
