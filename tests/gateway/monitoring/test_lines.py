"""The dated lines of the log."""

import json
from datetime import UTC, datetime, timedelta, timezone

from gateway.cycle.record import NOTHING
from gateway.cycle.supervisor import State
from gateway.monitoring.block import Change
from gateway.monitoring.lines import json_line, json_note, text_line, text_note
from gateway.reasons import Reason

DATE = datetime(2026, 11, 23, 7, 8, 9, 123456, tzinfo=timezone(timedelta(hours=1)))
TRIP = Change(
    tick=250, now=2.5, state=State.RAMPDOWN, reason=Reason.STALE, fault=int(Reason.TIMEOUT)
)


def test_text_has_date_with_zone_state_reason_and_fault() -> None:
    assert text_line(TRIP, DATE) == (
        "2026-11-23T07:08:09.123+01:00  RAMPDOWN   STALE: no fresh sample in time  "
        "fault TIMEOUT: PLC did not answer in time"
    )
    quiet = Change(tick=0, now=0.0, state=State.RUN, reason=NOTHING, fault=NOTHING)
    assert text_line(quiet, DATE.astimezone(UTC)) == "2026-11-23T06:08:09.123+00:00  RUN"


def test_json_is_one_line_whose_time_any_reader_understands() -> None:
    text = json_line(TRIP, DATE)
    assert "\n" not in text
    found = json.loads(text)
    assert datetime.fromisoformat(found["time"]) == DATE.replace(microsecond=123000)
    assert (found["level"], found["event"], found["state"]) == ("warning", "state", "RAMPDOWN")
    assert (found["reason"], found["fault"], found["tick"]) == ("STALE", "TIMEOUT", 250)


def test_operator_is_told_what_to_do_next() -> None:
    armed = Change(tick=0, now=0.0, state=State.ARMED, reason=NOTHING, fault=NOTHING)
    safe = Change(tick=9, now=0.0, state=State.SAFE, reason=Reason.STALE, fault=NOTHING)
    assert text_line(armed, DATE).endswith("(to start: turn remote on at the PLC, from off)")
    assert text_line(safe, DATE).endswith("(to acknowledge: turn remote off and on at the PLC)")


def test_words_of_the_link_have_a_line_of_their_own() -> None:
    words = "192.0.2.1:502 unit 1: cannot connect: Connection refused"
    assert text_note("link", words, DATE) == f"2026-11-23T07:08:09.123+01:00  link       {words}"
    found = json.loads(json_note("link", words, DATE))
    assert (found["event"], found["level"], found["message"]) == ("link", "warning", words)
