"""The table of states as specified, every transition, every reason, every one refused."""

from dataclasses import replace

import pytest

from gateway.cycle.supervisor import TRANSITIONS, Event, Facts, State, Supervisor, advance
from gateway.reasons import Reason

GOOD = Facts(
    now=10.0,
    link=None,
    write=None,
    check=None,
    remote=False,
    confirmed=False,
    at_rest=False,
    stop_requested=False,
    shadow=False,
)
RUNNING = Supervisor(state=State.RUN, released=False, started=9.0, confirmed=True)
STARTING = Supervisor(state=State.RUN, started=9.5)
REMOTE = replace(GOOD, remote=True)
DRIVING = replace(REMOTE, confirmed=True)


def after(before, facts):
    found = advance(before, facts)
    return found.state, found.reason


def test_numbers_of_the_states_are_what_recordings_hold():
    assert {state.name: state.value for state in State} == {
        "OFF": 0,
        "CONNECT": 1,
        "SHADOW": 2,
        "ARMED": 3,
        "RUN": 4,
        "RAMPDOWN": 5,
        "SAFE": 6,
    }


def test_no_way_leads_into_run_but_from_armed_and_none_out_but_by_the_rampdown():
    into = [state for state, events in TRANSITIONS.items() if State.RUN in events.values()]
    assert into == [State.ARMED]
    assert TRANSITIONS[State.RUN] == {Event.TRIP: State.RAMPDOWN}
    assert TRANSITIONS[State.RAMPDOWN] == {Event.AT_REST: State.SAFE}


def test_before_the_first_tick_it_is_off_and_has_seen_nothing():
    begin = Supervisor()
    assert (begin.state, begin.reason, begin.started) == (State.OFF, None, 0.0)
    assert not begin.released
    assert not begin.confirmed


def test_the_loop_starts_by_connecting():
    assert after(Supervisor(), GOOD) == (State.CONNECT, None)


def test_a_stopped_gateway_stays_off_and_remembers_why():
    before = Supervisor(state=State.OFF, reason=Reason.TIMEOUT)
    assert after(before, replace(GOOD, stop_requested=True)) == (State.OFF, Reason.TIMEOUT)


@pytest.mark.parametrize("state", [State.CONNECT, State.SHADOW, State.ARMED])
def test_a_stop_before_the_run_switches_off_whatever_else_is_the_matter(state):
    facts = replace(REMOTE, stop_requested=True, link=Reason.TIMEOUT, check=Reason.PLC_FAULT)
    before = Supervisor(state=state, released=True)
    assert after(before, facts) == (State.OFF, Reason.STOP_REQUESTED)


def test_connect_waits_with_the_reason_and_ends_in_shadow():
    before, dead = Supervisor(state=State.CONNECT), replace(GOOD, link=Reason.NOT_CONNECTED)
    assert after(before, dead) == (State.CONNECT, Reason.NOT_CONNECTED)
    assert after(before, GOOD) == (State.SHADOW, None)


def test_shadow_is_left_for_armed_when_all_checks_hold():
    before = Supervisor(state=State.SHADOW)
    assert after(before, GOOD) == (State.ARMED, None)
    assert after(before, REMOTE) == (State.ARMED, None)
    not_ready = replace(GOOD, check=Reason.PLC_NOT_READY)
    assert after(before, not_ready) == (State.SHADOW, Reason.PLC_NOT_READY)


def test_shadow_only_stays_in_shadow():
    assert after(Supervisor(state=State.SHADOW), replace(GOOD, shadow=True)) == (State.SHADOW, None)


@pytest.mark.parametrize("state", [State.SHADOW, State.ARMED])
def test_without_a_link_it_connects_again(state):
    facts = replace(REMOTE, link=Reason.CONNECTION_LOST, check=Reason.PLC_FAULT)
    before = Supervisor(state=state, released=True)
    assert after(before, facts) == (State.CONNECT, Reason.CONNECTION_LOST)


def test_armed_falls_back_to_shadow_when_a_check_fails():
    facts = replace(REMOTE, check=Reason.INTERLOCK)
    before = Supervisor(state=State.ARMED, released=True)
    assert after(before, facts) == (State.SHADOW, Reason.INTERLOCK)


def test_remote_that_was_on_before_arming_starts_nothing():
    armed = advance(Supervisor(state=State.SHADOW, released=True), REMOTE)
    assert armed.state is State.ARMED
    assert after(armed, REMOTE) == (State.ARMED, None)


def test_remote_set_while_armed_starts_the_run():
    armed = advance(Supervisor(state=State.SHADOW), REMOTE)
    seen_off = advance(armed, GOOD)
    assert seen_off.state is State.ARMED
    running = advance(seen_off, replace(REMOTE, now=11.0))
    assert running == Supervisor(state=State.RUN, started=11.0)


def test_armed_starts_nothing_while_its_writes_fail():
    before = Supervisor(state=State.ARMED, released=True)
    assert after(before, replace(REMOTE, write=Reason.EXCEPTION_2)) == (
        State.ARMED,
        Reason.EXCEPTION_2,
    )


def test_remote_seen_off_stays_seen():
    seen_off = advance(Supervisor(state=State.ARMED), GOOD)
    still = advance(seen_off, replace(GOOD, now=10.5))
    assert still.released
    assert advance(still, REMOTE).state is State.RUN


def test_remote_off_on_a_dead_link_does_not_count():
    before = Supervisor(state=State.SAFE, reason=Reason.TIMEOUT)
    dead = advance(before, replace(GOOD, link=Reason.TIMEOUT))
    assert not dead.released
    assert advance(dead, REMOTE).state is State.SAFE


def test_a_run_goes_on_while_nothing_is_the_matter():
    same = advance(RUNNING, DRIVING)
    assert same == RUNNING


def test_confirmation_is_remembered():
    assert not advance(STARTING, REMOTE).confirmed
    assert advance(STARTING, DRIVING).confirmed
    assert not advance(Supervisor(state=State.SAFE), DRIVING).confirmed


@pytest.mark.parametrize(("now", "state"), [(10.5, State.RUN), (10.501, State.RAMPDOWN)])
def test_the_plc_has_one_second_to_confirm(now, state):
    assert advance(STARTING, replace(REMOTE, now=now)).state is state


def test_late_confirmation_is_named():
    late = replace(REMOTE, now=10.6)
    assert after(STARTING, late) == (State.RAMPDOWN, Reason.NOT_CONFIRMED)
    assert after(STARTING, replace(late, confirmed=True)) == (State.RUN, None)


TRIPS = [
    ({"link": Reason.HEARTBEAT_FROZEN}, Reason.HEARTBEAT_FROZEN),
    ({"write": Reason.EXCEPTION_2}, Reason.EXCEPTION_2),
    ({"check": Reason.EMERGENCY_STOP}, Reason.EMERGENCY_STOP),
    ({"stop_requested": True}, Reason.STOP_REQUESTED),
    ({"remote": False}, Reason.REMOTE_OFF),
    ({"confirmed": False}, Reason.PLC_LEFT),
]


@pytest.mark.parametrize(("fact", "reason"), TRIPS)
def test_each_trip_ramps_down_with_its_reason(fact, reason):
    assert after(RUNNING, replace(DRIVING, **fact)) == (State.RAMPDOWN, reason)


@pytest.mark.parametrize("place", range(len(TRIPS) - 1))
def test_the_deeper_cause_is_named_when_several_come_together(place):
    facts = {}
    for fact, _ in TRIPS[place:]:
        facts |= fact
    assert after(RUNNING, replace(DRIVING, **facts)) == (State.RAMPDOWN, TRIPS[place][1])


def test_rampdown_ends_in_safe_at_rest_and_keeps_the_reason():
    before = Supervisor(state=State.RAMPDOWN, reason=Reason.TIMEOUT)
    assert after(before, DRIVING) == (State.RAMPDOWN, Reason.TIMEOUT)
    assert after(before, replace(DRIVING, at_rest=True)) == (State.SAFE, Reason.TIMEOUT)


def test_safe_is_left_by_remote_off_and_on_again_only():
    before = Supervisor(state=State.SAFE, reason=Reason.TIMEOUT)
    assert after(before, REMOTE) == (State.SAFE, Reason.TIMEOUT)
    off = advance(before, GOOD)
    assert (off.state, off.reason) == (State.SAFE, Reason.TIMEOUT)
    assert after(off, GOOD) == (State.SAFE, Reason.TIMEOUT)
    dead = replace(REMOTE, link=Reason.TIMEOUT)
    assert after(off, dead) == (State.SAFE, Reason.TIMEOUT)
    assert after(off, REMOTE) == (State.SHADOW, None)


def test_what_acknowledges_does_not_also_start():
    seen = Supervisor(state=State.SAFE, reason=Reason.TIMEOUT)
    for facts in (GOOD, REMOTE, REMOTE, REMOTE):
        seen = advance(seen, facts)
    assert seen.state is State.ARMED


def test_a_stop_in_safe_switches_off_and_keeps_the_reason():
    before = Supervisor(state=State.SAFE, reason=Reason.TIMEOUT, released=True)
    assert after(before, replace(REMOTE, stop_requested=True)) == (State.OFF, Reason.TIMEOUT)


def test_the_time_of_entry_is_kept_until_the_state_is_left():
    entered = advance(Supervisor(state=State.SHADOW, started=1.0), GOOD)
    assert entered.started == 10.0
    assert advance(entered, replace(GOOD, now=12.0)).started == 10.0
