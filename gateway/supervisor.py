"""What the gateway is doing, and what it does next: states, one table, one reason for every exit.

`advance` is told the facts of this tick (`Facts`), names the one event that they amount to, and
looks the next state up in TRANSITIONS; an event that the table does not know there changes nothing.
Whoever wants to know why a run ended reads `reason`: it is set where a state is left against the
wish of the operator, and kept until the bench is armed again.
"""

from dataclasses import dataclass
from enum import Enum, IntEnum

from gateway.reasons import Reason as Reason  # State and Reason belong together


class State(IntEnum):
    """What the gateway is doing."""

    OFF = 0
    CONNECT = 1
    SHADOW = 2
    ARMED = 3
    RUN = 4
    RAMPDOWN = 5
    SAFE = 6


class Event(Enum):
    """What can happen."""

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
    """What is known at one tick.

    link : None: a fresh sample is at hand; otherwise why there is none
    check : None: all checks hold; otherwise the first that does not
    remote, confirmed : status bits of the PLC: remote; enabled and road load
    at_rest : the setpoint has come down to zero
    """

    now: float
    link: Reason | None
    check: Reason | None
    remote: bool
    confirmed: bool
    at_rest: bool
    stop_requested: bool
    shadow: bool


@dataclass(frozen=True, kw_only=True)
class Supervisor:
    """State of the supervisor.

    released : remote has been seen off since this state was entered, so that on is a wish of now
    started : when RUN was entered [s]; confirmed : the PLC has confirmed enable and road load
    """

    state: State = State.OFF
    reason: Reason | None = None
    released: bool = False
    started: float = 0.0
    confirmed: bool = False
