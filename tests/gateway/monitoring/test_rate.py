"""The rate limit: a burst passes, a flood does not, and the last line is always told."""

import json

from gateway.cycle.record import Tick
from gateway.cycle.supervisor import State
from gateway.monitoring.rate import BURST, EVERY, Rate
from gateway.monitoring.terminal import RunLog
from gateway.reasons import Reason
from tests.gateway.monitoring.identities import IDENTITY
from tests.gateway.monitoring.test_block import good, shown


def rate() -> Rate:
    return Rate(lambda count: f"{count} left out")


def names(first: int, last: int) -> list[str]:
    return [f"line {number}" for number in range(first, last)]


def test_a_burst_passes_and_a_quiet_log_is_never_limited() -> None:
    one = rate()
    assert one.filter(names(0, BURST), 100.0) == names(0, BURST)
    for number in range(1, 50):
        assert one.filter(["again"], 100.0 + number * EVERY) == ["again"]


def test_flood_is_counted_and_its_newest_line_comes_when_it_may() -> None:
    one = rate()
    assert one.filter(names(0, BURST + 7), 100.0) == names(0, BURST)
    assert one.filter(["line 27"], 100.1) == []
    assert one.filter([], 100.0 + EVERY) == ["7 left out", "line 27"]
    assert one.filter([], 200.0) == []


def test_ten_lines_a_second_for_an_hour_are_not_more_than_the_rate() -> None:
    one = rate()
    written = [
        line
        for tick in range(36000)
        for line in one.filter([f"line {tick}"], 0.1 * tick)
        if line.startswith("line")
    ]
    assert BURST + 3600 / EVERY - 2 <= len(written) <= BURST + 3600 / EVERY


def test_end_of_the_run_tells_what_is_held() -> None:
    one = rate()
    one.filter(names(0, BURST + 2), 100.0)
    assert one.flush() == ["1 left out", f"line {BURST + 1}"]
    assert one.flush() == []


def test_log_begins_with_recording_and_what_real_time_was_refused() -> None:
    first, second = RunLog(IDENTITY, "text").lines(shown(good(0)), 100.0, over=False)
    assert first.endswith("start      runs/1.rlrec; real time: " + IDENTITY.real_time)
    assert second.endswith("RUN")
    (told, *_) = RunLog(IDENTITY, "json").lines(shown(), 100.0, over=False)
    assert '"level": "warning", "event": "start"' in told


def test_log_tells_an_alarm_once_and_its_acknowledgement() -> None:
    log = RunLog(IDENTITY, "json")
    trip = [good(0), good(1, State.RAMPDOWN, Reason.TIMEOUT), good(2, State.SAFE, Reason.TIMEOUT)]

    def alarms(*ticks: Tick) -> list[dict[str, str]]:
        lines = map(json.loads, log.lines(shown(*ticks), 100.0, over=False))
        return [line for line in lines if line["event"] == "alarm"]

    (told,) = alarms(*trip)
    assert told["level"] == "warning"
    assert told["message"].startswith("TIMEOUT: PLC did not answer in time: 1 time, first 20")
    assert told["message"].endswith(", not acknowledged")
    assert alarms(*trip) == []
    (told,) = alarms(*trip, good(3, State.SHADOW))
    assert (told["level"], told["message"][-14:]) == ("info", ", acknowledged")


def test_link_that_comes_and_goes_does_not_fill_the_log() -> None:
    """200 changes between two looks: the ring keeps 64 of them."""
    ticks = [
        good(number, State.CONNECT, Reason.NOT_CONNECTED if number % 2 else Reason.TIMEOUT)
        for number in range(200)
    ]
    log = RunLog(IDENTITY, "text")
    written = log.lines(shown(*ticks), 100.0, over=True)
    assert len(written) == BURST + 2
    # the start takes one of the burst; 64 - 19 are left over, the last of which is told
    assert written[-2].endswith(f"{200 - (BURST - 1) - 1} lines left out")
