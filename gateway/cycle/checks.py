"""What must hold before the bench is armed and while it runs: the first reason that it does not.

The PLC guards itself with its own limits and interlocks; the gateway reads what it says of them.
"""

from gateway.configuration.config import Config
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from register_maps.signals import Alarm, Interlock, Measurement, Status

ALL_CLOSED = Interlock(sum(Interlock))
ALARMS_OF_LAST_RUN = Alarm.COMMUNICATION | Alarm.SETPOINT_REJECTED
"""Alarms that stand until they are acknowledged; before a run they tell of the last one."""
APART_AT_REST, APART_RUNNING = 0.5, 3.0
"""[rad/s] that motor / ratio and drum may differ: in the backlash the drum runs ahead by 1.3."""
QUIET = 1.0
"""[s] for which no other master may have written."""


def check(
    config: Config,
    measurement: Measurement,
    *,
    state: State,
    overruns: int,
    echo_age: float,
    other_age: float,
) -> Reason | None:
    """The first check that does not hold, None: all hold.

    overruns : deadlines missed in a row; echo_age : since the PLC last took a command over [s]
    other_age : since it last took over one that is not ours [s]
    """
    running = state is State.RUN
    problem = (
        _bench(config, measurement)
        or _alarm(measurement, running=running)
        or _speeds_apart(config, measurement, APART_RUNNING if running else APART_AT_REST)
    )
    if problem is not None:
        return problem
    if other_age <= QUIET:
        return Reason.OTHER_MASTER
    if running:
        return _running(config, overruns, echo_age)
    return None if Status.READY in measurement.status else Reason.PLC_NOT_READY


def _bench(config: Config, measurement: Measurement) -> Reason | None:
    """Emergency stop, overspeed, interlocks."""
    status, interlock = measurement.status, measurement.interlock
    closed = ALL_CLOSED if interlock is None else interlock
    if Status.EMERGENCY_STOP_OK not in status or Interlock.EMERGENCY_STOP not in closed:
        return Reason.EMERGENCY_STOP
    if abs(measurement.motor_speed) > config.limits.overspeed:
        return Reason.OVERSPEED
    return None if ALL_CLOSED in closed else Reason.INTERLOCK


def _alarm(measurement: Measurement, *, running: bool) -> Reason | None:
    alarm = measurement.alarm or Alarm(0)
    if Alarm.OVERSPEED in alarm:
        return Reason.OVERSPEED
    if Status.FAULT in measurement.status:
        return Reason.PLC_FAULT
    if Alarm.SETPOINT_REJECTED in alarm:
        return Reason.SETPOINT_REJECTED if running else Reason.MAP_VERSION
    if alarm & ~ALARMS_OF_LAST_RUN or (running and alarm):
        return Reason.PLC_ALARM
    return None


def _running(config: Config, overruns: int, echo_age: float) -> Reason | None:
    if overruns >= config.loop.overruns:
        return Reason.OVERRUN
    return Reason.NOT_ECHOED if echo_age > config.loop.stale else None


def _speeds_apart(config: Config, measurement: Measurement, allowed: float) -> Reason | None:
    """Whether motor and drum turn as one gear joins them: wiring, scaling, word order."""
    gear_speed = measurement.motor_speed / config.bench.gear_ratio
    far = abs(gear_speed - measurement.drum_speed) > allowed
    return Reason.IMPLAUSIBLE if far else None
