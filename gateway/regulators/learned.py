"""The learned regulator: it crosses the backlash as the last repeats of the cycle have taught it.

At first it works as the compensated regulator does: virtual truck, lead, trim. Both know of a
reversal only when the drum already falls through the backlash. Then the gear hurries after the
drum, and the flanks meet at speed. Where a cycle repeats, the reversal is known beforehand:

1. The torque between gear and drum that the virtual truck asks for,
       N = (1 - rho) T_w' + rho r_d F_RL,    rho = (J_g + J_d) / (m r_d^2),
   passes zero at a time after the truck's start. The regulator notes time and direction.
2. In the next repeat the gear crosses the backlash around that time. It accelerates relative to
   the truck for half of the way at the slope that the limits allow, and brakes for the other half.
   So the flanks meet without relative speed, while hardly any torque is missing between them.
3. Each repeat moves the crossing by a step, and measures the drum's squared error around it. A
   step that made the error larger is taken back and halved, with the other sign.

A repeat begins when the virtual truck starts, and ends when it stands. Until the time at which the
last repeat ended, the whole friction is compensated: a small share is left out against a run-away,
which takes minutes. The first start of a truck, and a cycle that is driven otherwise, cross the
backlash unprepared. A crossing that was planned and not needed moves the drum by the backlash, and
is forgotten. The memory outlives a run in `regulator.learned` of the configuration.
"""

from dataclasses import dataclass, replace
from math import copysign, exp, sqrt

from gateway.configuration.config import Config
from gateway.configuration.memory import NOTHING, Crossing, Memory
from gateway.physics import following
from gateway.physics.following import FollowedTruck, Following, advance, follow, lead_and_trim
from gateway.physics.virtual_truck import truck_torque
from gateway.physics.window import Window
from gateway.regulators.demand import Demand

__all__ = ["Params", "State", "follow", "seed", "update"]

TORQUE_SMOOTH, TORQUE_MARGIN = 0.1, 100.0
"""[s], [N m] Smoothing of the torque between gear and drum, and the torque that makes a flank sure:
three standard deviations of the smoothed torque with a noise of 0.01 rad/s at the drum."""
FIRST_DELAY, STEP = 0.04, 0.03
"""[s] Delay of the first planned crossing, and the first change of it."""
BEFORE, AFTER = 0.6, 1.0
"""[s] Time around a crossing over which the drum's error counts."""
SAME = 0.5
"""[s] Difference up to which two times of a reversal are those of the same crossing."""


@dataclass(frozen=True, kw_only=True)
class Params(FollowedTruck):
    """Parameters of the regulator in SI.

    preview : time by which a planned crossing leads [s]
    backlash : whole width at the gear output [rad]; approach : relative acceleration [rad/s^2]
    memory : of the repeats before this run
    """

    preview: float
    backlash: float
    approach: float
    memory: Memory

    @classmethod
    def of(cls, config: Config) -> "Params":
        """Parameters out of the configuration."""
        truck, own, limits = FollowedTruck.of(config), config.regulator, config.limits
        return cls(
            **vars(truck),
            preview=own.lead,
            backlash=2.0 * config.bench.backlash_half_gap,
            approach=min(limits.rate_up, limits.rate_down) / truck.gear_ratio,
            memory=own.learned,
        )

    @property
    def half_time(self) -> float:
        """Time from the beginning of a planned crossing to its middle [s]."""
        return sqrt(self.backlash / self.approach)


@dataclass(frozen=True, kw_only=True)
class Repeat:
    """What a repeat has shown so far.

    time : since the truck's start [s]
    torque : between gear and drum, smoothed [N m]; side : its last sure sign, 0: none yet
    crossed : time at which its sign changed last [s]
    found : reversals as (time, direction)
    costs : squared error of the drum around each remembered crossing [rad^2/s]
    """

    time: float = 0.0
    torque: float = 0.0
    side: float = 0.0
    crossed: float = 0.0
    found: tuple[tuple[float, float], ...] = ()
    costs: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class State(Following):
    """The followed virtual truck, and what the regulator has learned.

    repeat : None before the first start of the truck
    """

    memory: Memory = NOTHING
    repeat: Repeat | None = None


def seed(params: Params, motor_speed: float, drum_speed: float) -> State:
    """State whose demand is the measured motor speed [rad/s]."""
    return State(**vars(following.seed(params, motor_speed, drum_speed)), memory=params.memory)


def update(params: Params, state: State, window: Window) -> tuple[State, Demand]:
    """State and demand after one new sample."""
    torque = truck_torque(_known_friction(params, state), window)
    after, acceleration = advance(params, state, torque, window)
    if not after.moving:
        return (_remember(after) if state.moving else after), Demand(speed=0.0)
    after = replace(after, repeat=_watch(params, state, torque, after.virtual_speed, window))
    planned = _planned(params, after)
    speed, rate = lead_and_trim(params, after, acceleration, window, planned)
    return after, Demand(speed=speed, rate=rate)


def _known_friction(params: Params, state: State) -> Params:
    """Parameters with the whole friction while a known cycle repeats."""
    if state.repeat is None or state.repeat.time >= state.memory.duration:
        return params
    none = 0.0
    return replace(params, under_compensation=none, under_compensation_slow=none)


def _planned(params: Params, state: State) -> tuple[float, float]:
    """Speed [rad/s] and slope [rad/s^2] of the gear relative to the truck at this time."""
    speed = slope = 0.0
    if state.repeat is None:
        return speed, slope
    for one in state.memory.crossings:
        since = state.repeat.time + params.preview - one.time - one.delay
        if abs(since) < params.half_time:
            speed += one.direction * params.approach * (params.half_time - abs(since))
            slope -= one.direction * copysign(params.approach, since)
    return speed, slope


def _watch(
    params: Params, state: State, truck: float, speed: float, window: Window
) -> Repeat | None:
    """What the repeat has shown with this window; truck : its torque on the drum [N m]."""
    if not state.moving:
        return Repeat(costs=(0.0,) * len(state.memory.crossings))
    last = state.repeat
    if last is None:
        return None  # the run began with a rolling truck: nobody saw its start
    rho, r_d = params.drum_inertia / params.inertia, params.drum_radius
    road = r_d * params.road.force(r_d * speed)
    between = (1.0 - rho) * truck + rho * road
    torque = between + (last.torque - between) * exp(-window.duration / TORQUE_SMOOTH)
    time = last.time + window.duration
    crossed = time - TORQUE_SMOOTH if torque * last.torque < 0.0 else last.crossed
    side, found = last.side, last.found
    if abs(torque) > TORQUE_MARGIN:
        side = copysign(1.0, torque)
        if side * last.side < 0.0:
            found = (*found, (crossed, -side))
    error = (speed - window.drum_speed) ** 2 * window.duration
    costs = tuple(
        cost + error * (-BEFORE < time - one.time < AFTER)
        for cost, one in zip(last.costs, state.memory.crossings, strict=True)
    )
    return Repeat(time=time, torque=torque, side=side, crossed=crossed, found=found, costs=costs)


def _remember(state: State) -> State:
    """State after a repeat: the next one crosses the backlash where this one had to."""
    repeat, memory = state.repeat, state.memory
    if repeat is None:
        return state
    crossings = tuple(_improve(memory, repeat, *one) for one in repeat.found)
    return replace(state, repeat=None, memory=Memory(duration=repeat.time, crossings=crossings))


def _improve(memory: Memory, repeat: Repeat, time: float, direction: float) -> Crossing:
    """Crossing of the next repeat for a reversal of this one."""
    for one, cost in zip(memory.crossings, repeat.costs, strict=True):
        if one.direction == direction and abs(one.time - time) < SAME:
            if one.cost and cost > one.cost:
                step = -one.step / 2.0
                return replace(one, time=time, delay=one.best + step, step=step)
            return replace(one, time=time, delay=one.delay + one.step, best=one.delay, cost=cost)
    return Crossing(
        time=time,
        direction=direction,
        delay=FIRST_DELAY,
        best=FIRST_DELAY,
        cost=0.0,
        step=STEP,
    )
