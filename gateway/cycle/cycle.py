"""One tick of the gateway, pure: observation -> supervisor -> regulator -> limits -> command block.

`step` has no clock and no randomness. The same configuration, map and observations give the same
outputs, bit for bit, so that a recording can be replayed.

The regulator runs in every state that has samples, so that shadow mode shows its demand. The demand
is used in RUN only. Until the PLC confirms the start, every sample seeds the regulator anew, so
that the first setpoint is the measured speed. In RAMPDOWN the setpoint goes from its last value to
zero and needs no measurement. `command.py` says when a command block is written.
"""

from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any, cast

from gateway import regulators
from gateway.configuration.config import Config
from gateway.cycle import command, limits, program, samples, surveillance
from gateway.cycle.checks import check
from gateway.cycle.command import Command
from gateway.cycle.limits import Limit, Limited, Limits
from gateway.cycle.samples import Samples
from gateway.cycle.supervisor import Facts, Reason, State, Supervisor, advance
from gateway.cycle.surveillance import Surveillance
from gateway.errors import ConfigError
from gateway.plausibility.tolerances import Params
from gateway.regulators import Regulator
from gateway.regulators.demand import Demand
from register_maps.register_map import RegisterMap
from register_maps.signals import Measurement, Setpoint, Status

UNLINKED = frozenset({State.OFF, State.CONNECT})
FOLLOWED = Limit.NOT_FINITE | Limit.DEVIATION
"""Limits after which the regulator continues from the setpoint, because the bench never reached the
demand. After the slope limit the setpoint catches up by itself; stale data end the run."""
BRIDGED = 2.0
"""Periods for which a demand continues along its slope without a new sample."""


@dataclass(frozen=True, kw_only=True)
class Observation:
    """The inputs of one tick.

    now : monotonic time of the reading [s]
    measurement : the decoded block, None: no good block, `fault` says why
    fault : of this tick's reading, otherwise of the last write before it
    shadow, stop_requested : never write; a signal or the end of the duration asks for a stop
    overruns : deadlines missed in a row up to this tick
    latency : from wake-up to the end of the write, of the tick before [s]
    """

    now: float
    measurement: Measurement | None
    fault: Reason | None = None
    shadow: bool = False
    stop_requested: bool = False
    overruns: int = 0
    latency: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Output:
    """The decision of one tick.

    setpoint : the command block to write, None: write nothing
    demand : motor speed that the regulator wants, before the limits [rad/s]; None: no sample yet
    state, reason : of the supervisor; why the last run ended or the bench cannot be armed
    age : of the newest sample [s], None: no sample yet
    finished : the program of the configuration has come to its end
    """

    setpoint: Setpoint | None
    demand: float | None
    state: State
    reason: Reason | None
    age: float | None
    finished: bool = False


@dataclass(frozen=True, kw_only=True)
class CycleState:
    """State that one tick hands to the next.

    params, regulator : parameters of the regulator, and its state (None: no sample yet)
    watched : sensors, motion and pace
    demand, demanded : last demand, and its time [s]
    """

    params: Any
    limits: Limits
    watched: Surveillance
    supervisor: Supervisor = field(default_factory=Supervisor)
    samples: Samples = field(default_factory=Samples)
    regulator: Any = None
    demand: Demand | None = None
    demanded: float = 0.0
    command: Command = field(default_factory=Command)


def initial(config: Config, register_map: RegisterMap) -> CycleState:
    """State before the first tick. Raises ConfigError where map and configuration do not fit."""
    needed = samples.NEEDS[config.regulator.torque]
    if register_map.register(needed) is None:
        raise ConfigError(
            f"the register map {register_map.name} has no {needed}",
            place="[regulator] torque",
            value=config.regulator.torque,
            expected=" or ".join(
                kind for kind, signal in samples.NEEDS.items() if register_map.register(signal)
            ),
        )
    return CycleState(
        params=_regulator(config).Params.of(config),
        limits=Limits(
            speed_max=config.limits.speed_max,
            rate_up=config.limits.rate_up,
            rate_down=config.limits.rate_down,
            deviation=config.limits.deviation,
            stale=config.loop.stale,
        ),
        watched=Surveillance(relations=Params.of(config)),
    )


def _regulator(config: Config) -> Regulator:
    """The maker of the demand: the configured regulator, or the program of the configuration."""
    if config.program is not None:
        return cast("Regulator", program)
    return regulators.load(config.regulator.name)


def step(
    config: Config, register_map: RegisterMap, state: CycleState, observation: Observation
) -> tuple[CycleState, Output]:
    """Return state and output after one tick."""
    now = observation.now
    read = samples.take(state.samples, observation.measurement, observation.fault, now)
    read = samples.with_window(config, register_map, read)
    sent = command.note_tick(state.command, now, observation.latency)
    sent = command.note_reply(sent, observation.measurement, observation.fault)
    sent = command.note_echo(register_map, sent, read.newest if read.is_new else None, now)
    writes = state.supervisor.state in command.WRITING and not observation.shadow
    watched = surveillance.note_latency(config, state.watched, observation.latency, writes=writes)
    watched = surveillance.note_samples(
        config, register_map, watched, read, setpoint=sent.speed, now=now
    )
    state = replace(state, samples=read, command=sent, watched=watched)
    supervisor = advance(state.supervisor, _facts(config, state, observation))
    if supervisor.state is State.RUN and state.supervisor.state is not State.RUN:
        state = _start_bumpless(state, now)
    state = _regulate(config, replace(state, supervisor=supervisor), now)
    limited = _limit(config, state, now)
    state = _follow_limits(config, state, limited, now)
    state, setpoint = _write(config, register_map, state, limited, observation)
    return state, Output(
        setpoint=setpoint,
        demand=None if state.demand is None else state.demand.speed,
        state=supervisor.state,
        reason=supervisor.reason,
        age=None if read.newest is None else read.age(now),
        finished=_is_finished(config, state),
    )


def _is_finished(config: Config, state: CycleState) -> bool:
    if config.program is None or state.regulator is None:
        return False
    return state.supervisor.state is State.RUN and program.is_over(state.params, state.regulator)


def _facts(config: Config, state: CycleState, observation: Observation) -> Facts:
    now, newest, sent = observation.now, state.samples.newest, state.command
    status = Status(0) if newest is None else newest.status
    before = state.supervisor.state
    return Facts(
        now=now,
        link=samples.fault(state.samples, now, config.loop.stale),
        write=command.fault(sent, now, config.loop.stale),
        check=None
        if newest is None
        else check(
            config,
            newest,
            state=before,
            overruns=observation.overruns,
            echo_age=_echo_age(config, state),
            other_age=now - sent.other_wrote,
            implausible=surveillance.reason(
                state.watched,
                now,
                running=before is State.RUN,
                confirmed=state.supervisor.confirmed,
            ),
        ),
        remote=Status.REMOTE in status,
        confirmed=command.is_confirmed(config, status),
        at_rest=state.command.speed == 0.0,
        stop_requested=observation.stop_requested,
        shadow=observation.shadow,
    )


def _echo_age(config: Config, state: CycleState) -> float:
    """Time for which blocks were sent and not echoed [s]; 0 without an echo in the map."""
    sent = state.command
    if sent.echo is None:
        return 0.0
    since = state.samples.sequence_moved - sent.echo_moved
    return min(since, sent.unanswered * config.loop.period)


def _start_bumpless(state: CycleState, now: float) -> CycleState:
    """Begin a run: the measured speed counts as the last setpoint, the wait for an echo starts."""
    newest = state.samples.newest
    measured = 0.0 if newest is None else newest.motor_speed
    speed = min(max(measured, 0.0), state.limits.speed_max)
    started = replace(state.command, speed=speed, written=now, echo_moved=now)
    return replace(state, command=started, watched=surveillance.begin(state.watched, now))


def _regulate(config: Config, state: CycleState, now: float) -> CycleState:
    """Let the regulator see the window of this tick, if there is one."""
    newest, supervisor = state.samples.newest, state.supervisor
    if newest is None or supervisor.state in UNLINKED:
        return replace(state, regulator=None, demand=None)
    regulator = _regulator(config)
    starting = supervisor.state is State.RUN and not supervisor.confirmed
    if starting or state.regulator is None:
        seeded = regulator.seed(state.params, newest.motor_speed, newest.drum_speed)
        measured = Demand(speed=max(newest.motor_speed, 0.0))
        return replace(state, regulator=seeded, demand=measured, demanded=now)
    if state.samples.window is None:
        return state
    after, demand = regulator.update(state.params, state.regulator, state.samples.window)
    if config.regulator.torque == "instantaneous":
        demand = replace(demand, rate=0.0)  # the thesis's staircase, kept to show what it does
    return replace(state, regulator=after, demand=demand, demanded=now)


def _limit(config: Config, state: CycleState, now: float) -> Limited:
    """The setpoint that the limits pass."""
    last, newest = state.command, state.samples.newest
    wanted = _demand_now(config, state, now)
    stopping = newest is None or state.supervisor.state is not State.RUN
    return limits.limit(
        wanted.speed,
        wanted.rate,
        last=last.speed,
        measured=last.speed if newest is None or stopping else newest.motor_speed,
        age=0.0 if stopping else state.samples.age(now),
        dt=now - last.written,
        limits=state.limits,
    )


def _demand_now(config: Config, state: CycleState, now: float) -> Demand:
    """The demand at this moment: in RUN that of the regulator along its slope, otherwise zero."""
    demand = state.demand
    if state.supervisor.state is not State.RUN or demand is None:
        return Demand(speed=0.0)
    since = min(now - state.demanded, BRIDGED * config.loop.period)
    return replace(demand, speed=demand.speed + demand.rate * since)


def _follow_limits(config: Config, state: CycleState, limited: Limited, now: float) -> CycleState:
    """Let the regulator continue from the setpoint where the limits changed its newest demand."""
    newest, demand = state.samples.newest, state.demand
    is_newest = state.supervisor.state is State.RUN and state.demanded == now
    if not (is_newest and limited.by & FOLLOWED) or newest is None or demand is None:
        return state
    regulator = _regulator(config)
    if not isfinite(demand.speed):
        after = regulator.seed(state.params, newest.motor_speed, newest.drum_speed)
    else:
        after = regulator.follow(state.params, state.regulator, demand.speed, limited.speed)
    return replace(state, regulator=after)


def _write(
    config: Config,
    register_map: RegisterMap,
    state: CycleState,
    limited: Limited,
    observation: Observation,
) -> tuple[CycleState, Setpoint | None]:
    """Make the command block of this tick; None: this state or this tick writes nothing."""
    now, seen, supervisor = observation.now, observation.measurement, state.supervisor
    if supervisor.state not in command.WRITING:
        return replace(state, command=command.reset(state.command, now)), None
    if supervisor.state is State.RUN and seen is None:
        return state, None
    enable = command.stays_enabled(config, state.command, supervisor, seen)
    after = command.next_command(register_map, state.command, limited, now, enable=enable)
    return replace(state, command=after), command.block(config, register_map, after, limited)
