"""The status block against the ticks that went in; a reader never sees half a tick."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gateway.cycle.record import NOTHING, Tick
from gateway.cycle.supervisor import State
from gateway.monitoring import block
from gateway.monitoring.block import BOUNDS, RING, SIZE, Block, Snapshot, copy, decode, quantile
from gateway.reasons import Reason
from tests.gateway.recordings.test_recorder import tick


def good(index: int, state: State = State.RUN, reason: int = NOTHING) -> Tick:
    return replace(tick(index), state=state, reason=reason, shadow=False)


def shown(*ticks: Tick) -> Snapshot:
    buffer = bytearray(SIZE)
    writer = Block(buffer)
    for one in ticks:
        writer.update(one)
    content = copy(buffer)
    assert content is not None
    return decode(content)


def test_newest_tick_is_shown_in_si_and_missing_values_are_nan() -> None:
    values = shown(good(0), good(1)).values
    assert (values.ticks, values.images, values.lost) == (2, 2, 0)
    assert (values.now, values.since) == (1000.01, 1000.0)
    assert (values.motor_speed, values.drum_speed, values.shaft_torque) == (0.1, -0.3, -12.8)
    assert values.setpoint == 1.0 / 3.0
    assert values.demand == 1.1
    assert math.isnan(values.armature_current)
    assert math.isnan(values.age)


def test_runs_trips_and_reasons_are_counted_once_each() -> None:
    """Two runs: the first ends by a time-out, the second by the operator, who is no trip."""
    found = shown(
        good(0, State.ARMED),
        good(1),
        good(2),
        good(3, State.RAMPDOWN, Reason.TIMEOUT),
        good(4, State.RAMPDOWN, Reason.TIMEOUT),
        good(5, State.SAFE, Reason.TIMEOUT),
        good(6, State.ARMED),
        good(7),
        good(8, State.RAMPDOWN, Reason.REMOTE_OFF),
    )
    assert (found.values.runs, found.values.trips) == (2, 1)
    assert found.reasons[Reason.TIMEOUT] == 1
    assert found.reasons[Reason.REMOTE_OFF] == 1
    assert [State(change.state).name for change in found.changes] == [
        *("ARMED", "RUN", "RAMPDOWN", "SAFE", "ARMED", "RUN", "RAMPDOWN")
    ]
    assert [change.tick for change in found.changes] == [0, 1, 3, 5, 6, 7, 8]


def test_ticks_without_a_good_image_are_lost_polls_and_their_faults_are_counted() -> None:
    lost = replace(tick(1, read_back=False), fault=int(Reason.TIMEOUT), reason=NOTHING)
    found = shown(good(0), lost, replace(lost, tick=2), good(3))
    assert (found.values.ticks, found.values.lost) == (4, 2)
    assert found.faults[Reason.TIMEOUT] == 2


def test_ring_keeps_the_last_changes_and_tells_how_many_there_were() -> None:
    states = (State.SHADOW, State.ARMED)
    found = shown(*(good(index, states[index % 2]) for index in range(RING + 6)))
    assert found.values.changes == RING + 6
    assert [change.tick for change in found.changes] == list(range(6, RING + 6))


def test_alarm_has_first_time_and_count_and_is_acknowledged_by_the_operator() -> None:
    """Two time-outs with an overspeed between them; remote off and on in SAFE acknowledges."""
    first = [
        good(0, State.RUN),
        good(1, State.RAMPDOWN, Reason.TIMEOUT),
        good(2, State.SAFE, Reason.TIMEOUT),
    ]
    (alarm,) = shown(*first).alarms
    assert (alarm.reason, alarm.count, alarm.acknowledged) == (Reason.TIMEOUT, 1, False)
    assert (alarm.first, alarm.last) == (1000.01, 1000.01)
    stopped = shown(*first, good(3, State.OFF, Reason.TIMEOUT)).alarms
    assert not stopped[0].acknowledged
    second = [*first, good(3, State.SHADOW), good(4, State.RUN)]
    assert shown(*second).alarms[0].acknowledged
    third = [*second, good(5, State.RAMPDOWN, Reason.OVERSPEED), good(6, State.SAFE)]
    timeout, overspeed = shown(*third).alarms
    assert (timeout.acknowledged, overspeed.acknowledged) == (True, False)
    again = [*third, good(7, State.SHADOW), good(8), good(9, State.RAMPDOWN, Reason.TIMEOUT)]
    timeout, overspeed = shown(*again).alarms
    assert (timeout.count, timeout.first, timeout.last) == (2, 1000.01, 1000.09)
    assert (timeout.acknowledged, overspeed.acknowledged) == (False, True)


def test_end_of_a_run_by_the_operator_is_no_alarm() -> None:
    assert shown(good(0), good(1, State.RAMPDOWN, Reason.REMOTE_OFF)).alarms == []


def test_histogram_counts_each_latency_below_its_bound() -> None:
    latencies = (0.00005, 0.0001, 0.00011, 0.0099, 0.5)
    found = shown(*(replace(good(k), latency=value) for k, value in enumerate(latencies)))
    below = [sum(found.latency[: k + 1]) for k in range(len(BOUNDS))]
    assert below == [sum(value <= bound for value in latencies) for bound in BOUNDS]
    assert found.values.latency_max == 0.5
    assert found.values.latency_sum == pytest.approx(sum(latencies))


def test_quantile_is_the_bound_above_the_exact_one() -> None:
    durations = np.random.default_rng(1).gamma(2.0, 4e-4, 1000)
    found = shown(*(replace(good(k), latency=float(v)) for k, v in enumerate(durations)))
    for share in (0.5, 0.99):
        exact = np.quantile(durations, share, method="inverted_cdf")
        assert quantile(found.latency, share) == min(b for b in BOUNDS if b >= exact)
    assert math.isnan(quantile([0] * len(BOUNDS), 0.5))


def test_reader_refuses_a_block_that_is_being_written() -> None:
    buffer = bytearray(SIZE)
    writer = Block(buffer)
    writer.update(good(0))
    seen: list[bytes | None] = []
    writer._count = lambda _: seen.append(copy(buffer))  # type: ignore[method-assign]
    writer.update(good(1))
    assert seen == [None]
    assert copy(buffer) is not None


def test_reader_refuses_a_copy_during_which_the_block_changed(monkeypatch) -> None:
    counters = iter((2, 4))
    monkeypatch.setattr(block, "sequence", lambda _: next(counters))
    assert copy(bytearray(SIZE)) is None
