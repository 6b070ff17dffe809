"""The checks that must hold before the bench is armed and while it runs.

The PLC guards itself with its own limits and interlocks. The gateway reads what the PLC reports of
them, and checks that motor and drum belong together.
"""

from gateway.configuration.config import Config
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from register_maps.signals import Alarm, Interlock, Measurement, Status

ALL_CLOSED = Interlock(sum(Interlock))
ALARMS_OF_LAST_RUN = Alarm.COMMUNICATION | Alarm.SETPOINT_REJECTED
"""Alarms that stay until they are acknowledged; before a run they belong to the last run."""
APART_AT_REST, APART_RUNNING = 0.5, 3.0
"""[rad/s] Allowed difference of motor / ratio and drum; in the backlash the drum gains 1.3."""
QUIET = 1.0
"""[s] Time without a write of another master, before the bench may run."""


def check(
    config: Config,
    measurement: Measurement,
    *,
    state: State,
    overruns: int,
    echo_age: float,
    other_age: float,
    implausible: Reason | None,
) -> Reason | None:
    """Reason of the first check that does not hold; None: all checks hold.

    overruns : deadlines missed in a row
    echo_age : time since the PLC last accepted a command [s]
    other_age : time since the PLC last accepted a command of another master [s]
    implausible : why the sensors contradict the model of the bench; None: they do not
    """
    running = state is State.RUN
    problem = (
        _bench(config, measurement)
        or _alarm(measurement, running=running)
        or _speeds_apart(config, measurement, APART_RUNNING if running else APART_AT_REST)
        or implausible
    )
    if problem is not None:
        return problem
    if other_age <= QUIET:
        return Reason.OTHER_MASTER
    if running:
        return _check_run(config, overruns, echo_age)
    return None if Status.READY in measurement.status else Reason.PLC_NOT_READY


def _bench(config: Config, measurement: Measurement) -> Reason | None:
    """Reason by emergency stop, overspeed or interlocks."""
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


def _check_run(config: Config, overruns: int, echo_age: float) -> Reason | None:
    if overruns >= config.loop.overruns:
        return Reason.OVERRUN
    return Reason.NOT_ECHOED if echo_age > config.loop.stale else None


def _speeds_apart(config: Config, measurement: Measurement, allowed: float) -> Reason | None:
    """Reason where motor and drum do not turn as one gear: wiring, scaling or word order."""
    gear_speed = measurement.motor_speed / config.bench.gear_ratio
    far = abs(gear_speed - measurement.drum_speed) > allowed
    return Reason.IMPLAUSIBLE if far else None
