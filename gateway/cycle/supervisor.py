"""The supervisor: the states of the gateway, one table of transitions, a reason for every exit.

`advance` takes the facts of this tick, finds the one event that follows from them, and looks the
next state up in TRANSITIONS. `reason` says why a run ended: it is set when a state is left against
the wish of the operator, and kept until the bench is armed again.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, IntEnum

from gateway.reasons import Reason

__all__ = ["TRANSITIONS", "Event", "Facts", "Reason", "State", "Supervisor", "advance"]


class State(IntEnum):
    """State of the gateway."""

    OFF = 0
    CONNECT = 1
    SHADOW = 2
    ARMED = 3
    RUN = 4
    RAMPDOWN = 5
    SAFE = 6


class Event(Enum):
    """Event that may change the state."""

    START = "the loop runs"
    STOP = "a stop is requested"
    LINK_UP = "a fresh sample has come"
    LINK_DOWN = "no connection, or no fresh sample in time"
    CHECKS_HOLD = "all checks hold"
    CHECK_FAILS = "a check does not hold"
    REMOTE_SET = "the operator sets remote at the PLC"
    TRIP = "the run may not go on"
    AT_REST = "the setpoint has come down to zero"
    ACKNOWLEDGED = "the operator has switched remote off and on again"


TRANSITIONS: dict[State, dict[Event, State]] = {
    State.OFF: {Event.START: State.CONNECT},
    State.CONNECT: {Event.STOP: State.OFF, Event.LINK_UP: State.SHADOW},
    State.SHADOW: {
        Event.STOP: State.OFF,
        Event.LINK_DOWN: State.CONNECT,
        Event.CHECKS_HOLD: State.ARMED,
    },
    State.ARMED: {
        Event.STOP: State.OFF,
        Event.LINK_DOWN: State.CONNECT,
        Event.CHECK_FAILS: State.SHADOW,
        Event.REMOTE_SET: State.RUN,
    },
    State.RUN: {Event.TRIP: State.RAMPDOWN},
    State.RAMPDOWN: {Event.AT_REST: State.SAFE},
    State.SAFE: {Event.STOP: State.OFF, Event.ACKNOWLEDGED: State.SHADOW},
}


@dataclass(frozen=True, kw_only=True)
class Facts:
    """Facts of one tick.

    now : time of the tick [s]
    link : why there is no fresh sample; None: there is one
    write : why no command arrives; None: commands arrive
    check : reason of the first check that does not hold; None: all checks hold
    remote : the operator has switched the PLC to remote
    confirmed : the PLC is enabled and in the mode of the run
    at_rest : the setpoint has come down to zero
    stop_requested, shadow : a stop is requested; nothing may be written
    """

    now: float
    link: Reason | None
    write: Reason | None
    check: Reason | None
    remote: bool
    confirmed: bool
    at_rest: bool
    stop_requested: bool
    shadow: bool


@dataclass(frozen=True, kw_only=True)
class Supervisor:
    """State of the supervisor.

    state, reason : state of the gateway, and why it is there
    released : remote has been off since this state was entered, so that a remote that is on is new
    started : time at which this state was entered [s]
    confirmed : the PLC has confirmed the run
    """

    state: State = State.OFF
    reason: Reason | None = None
    released: bool = False
    started: float = 0.0
    confirmed: bool = False


CONFIRM_WITHIN = 1.0
"""[s] Time within which the PLC has to confirm the run."""

Decision = tuple[Event | None, Reason | None]


def advance(before: Supervisor, facts: Facts) -> Supervisor:
    """Return the supervisor after the facts of one tick."""
    event, reason = DECISIONS[before.state](before, facts)
    state = TRANSITIONS[before.state][event] if event else before.state
    entered = state is not before.state
    return Supervisor(
        state=state,
        reason=reason,
        released=_is_released(facts) or (before.released and not entered),
        started=facts.now if entered else before.started,
        confirmed=state is State.RUN and facts.confirmed,
    )


def _is_released(facts: Facts) -> bool:
    return facts.link is None and not facts.remote


def _off(before: Supervisor, facts: Facts) -> Decision:
    return (None, before.reason) if facts.stop_requested else (Event.START, None)


def _connect(_before: Supervisor, facts: Facts) -> Decision:
    if facts.stop_requested:
        return Event.STOP, Reason.STOP_REQUESTED
    return (Event.LINK_UP, None) if facts.link is None else (None, facts.link)


def _shadow(_before: Supervisor, facts: Facts) -> Decision:
    if facts.stop_requested:
        return Event.STOP, Reason.STOP_REQUESTED
    if facts.link is not None:
        return Event.LINK_DOWN, facts.link
    armed = facts.check is None and not facts.shadow
    return (Event.CHECKS_HOLD, None) if armed else (None, facts.check)


def _armed(before: Supervisor, facts: Facts) -> Decision:
    if facts.stop_requested:
        return Event.STOP, Reason.STOP_REQUESTED
    if facts.link is not None:
        return Event.LINK_DOWN, facts.link
    if facts.check is not None:
        return Event.CHECK_FAILS, facts.check
    if facts.write is not None:
        return None, facts.write
    return (Event.REMOTE_SET, None) if facts.remote and before.released else (None, None)


def _run(before: Supervisor, facts: Facts) -> Decision:
    late = facts.now - before.started > CONFIRM_WITHIN
    trips = (
        (facts.link is not None, facts.link),
        (facts.write is not None, facts.write),
        (facts.check is not None, facts.check),
        (facts.stop_requested, Reason.STOP_REQUESTED),
        (not facts.remote, Reason.REMOTE_OFF),
        (before.confirmed and not facts.confirmed, Reason.PLC_LEFT),
        (late and not facts.confirmed, Reason.NOT_CONFIRMED),
    )
    reason = next((reason for tripped, reason in trips if tripped), None)
    return (None, None) if reason is None else (Event.TRIP, reason)


def _rampdown(before: Supervisor, facts: Facts) -> Decision:
    return (Event.AT_REST if facts.at_rest else None), before.reason


def _safe(before: Supervisor, facts: Facts) -> Decision:
    if facts.stop_requested:
        return Event.STOP, before.reason
    if facts.link is None and facts.remote and before.released:
        return Event.ACKNOWLEDGED, None
    return None, before.reason


DECISIONS: dict[State, Callable[[Supervisor, Facts], Decision]] = {
    State.OFF: _off,
    State.CONNECT: _connect,
    State.SHADOW: _shadow,
    State.ARMED: _armed,
    State.RUN: _run,
    State.RAMPDOWN: _rampdown,
    State.SAFE: _safe,
}
"""For each state: the event that follows from the facts, and the reason to show."""
