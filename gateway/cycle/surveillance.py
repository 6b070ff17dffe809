"""What is watched besides the PLC's own reports: sensors, motion and pace, in one record (pure)."""

from dataclasses import dataclass, field, replace

from gateway.configuration.config import Config
from gateway.cycle import following, pace
from gateway.cycle.following import Following
from gateway.cycle.samples import Samples, torque_of, without_sensor
from gateway.plausibility import relations as plausibility
from gateway.plausibility.relations import Plausibility
from gateway.plausibility.tolerances import Params
from gateway.reasons import Reason
from register_maps.register_map import RegisterMap


@dataclass(frozen=True, kw_only=True)
class Surveillance:
    """State of what is watched.

    relations, sensors : parameters and sums of the plausibility of the sensors
    following : whether the bench does what it is told
    slow : share of the last ticks that took too long [1]
    """

    relations: Params
    sensors: Plausibility = field(default_factory=Plausibility)
    following: Following = field(default_factory=Following)
    slow: float = 0.0


def note_samples(
    config: Config,
    register_map: RegisterMap,
    state: Surveillance,
    read: Samples,
    *,
    setpoint: float,
    now: float,
) -> Surveillance:
    """Note the samples of this tick; setpoint : the last one [rad/s]; now [s]."""
    newest = read.newest if read.is_new else None
    follows = following.note(config, state.following, newest, setpoint, now)
    state = replace(state, following=follows)
    if read.window is None or read.newest is None or read.before is None:
        return state
    before, last, duration = read.before, read.newest, read.window.duration
    shown = torque_of("integrated", register_map, last, before, duration)
    torque = without_sensor(config.regulator, shown, last, before, duration)
    sensors = plausibility.judge(
        state.relations, state.sensors, before, last, torque=torque, duration=duration
    )
    return replace(state, sensors=sensors)


def note_latency(
    config: Config, state: Surveillance, latency: float, *, writes: bool
) -> Surveillance:
    """Note how long the tick before took [s], and whether it wrote."""
    period = config.loop.period
    return replace(state, slow=pace.slow(state.slow, latency, writes=writes, period=period))


def begin(state: Surveillance, now: float) -> Surveillance:
    """State at the begin of a run: the bench has followed until now [s]."""
    return replace(state, following=Following(reference=now, motor=now))


def reason(state: Surveillance, now: float, *, running: bool, confirmed: bool) -> Reason | None:
    """Reason by sensors, motion or pace; None: nothing is wrong. now : our clock [s].

    running, confirmed : a run has begun, and the PLC has confirmed it
    """
    if found := plausibility.reason(state.relations, state.sensors, running=running):
        return found
    if running:
        return following.reason(state.following, now) if confirmed else None
    return pace.reason(state.slow)
