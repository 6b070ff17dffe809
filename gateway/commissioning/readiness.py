"""Readiness of the bench before a day's runs: a slow turn, a warm-up, and what they show (pure).

The run begins at rest: that is when the torque has its tare, and the speeds their zero.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gateway.commissioning.check import Check, missing
from gateway.commissioning.step_run import StepRun
from gateway.configuration.program import Program, Ramp
from gateway.configuration.sweep_speeds import RATE_RPM_S
from register_maps.timing import SCAN
from register_maps.units import RPM

OWN: Final = "own limit"
NAMES: Final = ("tare", "zero", "sign", "ratio", "warm-up", "heartbeat", "clock")
"""Names of the checks of a run."""
REST, TURN, WARM_UP = "rest", "turn", "warm-up"
REST_HOLD = 2.0
TURN_SPEED, TURN_HOLD = 300.0 * RPM, 5.0
WARM_SPEED: Final = 2000.0 * RPM
"""[rad/s] Near the speed of a travelling truck."""
FLAT_OVER: Final = 300.0
"""[s] Time over which the friction may change by its limit; a shorter warm-up tells less."""
REST_SETTLING: Final = 1.5
"""[s] First part of a held speed, which does not count."""
FEWEST_TICKS: Final = 10
"""Samples at rest that a tare needs."""
TARE, ZERO_MOTOR, ZERO_DRUM = 0.5, 0.5, 0.01
"""[N m], [rad/s], [rad/s]: what is left of the friction at rest holds the shaft twisted by 0.6 N m
at most; a digit of the speeds is 0.02 and 0.0005 rad/s."""
RATIO, FLAT, CLOCK, HEARTBEAT = 0.2, 0.5, 0.1, 1.0
"""[%]"""


def readiness_program(warm_up: float) -> Program:
    """Program of a slow turn and of a warm-up at one speed for `warm_up` [s]."""
    rate = RATE_RPM_S * RPM
    return Program(
        name="readiness",
        steps=(
            Ramp(speed=0.0, rate=rate, hold=REST_HOLD, label=REST),
            Ramp(speed=TURN_SPEED, rate=rate, hold=TURN_HOLD, label=TURN),
            Ramp(speed=WARM_SPEED, rate=rate, hold=warm_up, label=WARM_UP),
            Ramp(speed=0.0, rate=rate, hold=0.0),
        ),
    )


def evaluate(run: StepRun) -> list[Check]:
    """Tare, zeros, sign, ratio, warm-up, heartbeat and clock."""
    return [*_rest(run), *_turn(run), *_warm_up(run), *_clocks(run)]


def _check(name: str, what: str, value: float, unit: str, limit: float) -> Check:
    return Check(name=name, what=what, value=value, unit=unit, limit=limit, source=OWN)


def _rest(run: StepRun) -> list[Check]:
    """Tare of the torque and zeros of the speeds."""
    rest = next((part for _, part in run.parts(REST)), slice(0, 0))
    if rest.stop - rest.start < FEWEST_TICKS:
        return [missing("tare", "the bench did not stand before the turn", "Nm", TARE, OWN)]
    trace, known = run.trace, run.config.regulator.torque_offset
    torque = float(trace.shaft_torque[rest].mean())
    rows = (
        ("tare", f"torque at rest, configured {known:+.2f}", torque - known, "Nm", TARE),
        ("zero", "motor speed at rest", float(trace.motor_speed[rest].mean()), "1/s", ZERO_MOTOR),
        ("zero", "drum speed at rest", float(trace.drum_speed[rest].mean()), "1/s", ZERO_DRUM),
    )
    return [_check(*row) for row in rows]


def _held(run: StepRun, label: str, speed: float) -> NDArray[np.intp]:
    """Samples at which a speed is held and has settled."""
    for _, part in run.parts(label):
        near = np.abs(run.trace.motor_speed[part] - speed) < 0.02 * speed
        inside = part.start + np.flatnonzero(near)
        time = run.trace.time[inside]
        if len(inside):
            settled: NDArray[np.intp] = inside[time >= time[0] + REST_SETTLING]
            return settled
    return np.zeros(0, dtype=np.intp)


def _turn(run: StepRun) -> list[Check]:
    """Signs of torque and drum, and ratio of the speeds."""
    held = _held(run, TURN, TURN_SPEED)
    if not len(held):
        return [missing("sign", "the slow turn did not come to its speed", "", 0.0, OWN)]
    trace = run.trace
    torque, drum = float(trace.shaft_torque[held].mean()), float(trace.drum_speed[held].mean())
    ratio = float(trace.motor_speed[held].mean()) / drum if drum else np.nan
    off = 100.0 * (ratio / run.config.bench.gear_ratio - 1.0)
    what = f"torque {torque:+.1f} Nm opposes, drum {drum:+.2f} rad/s follows"
    wrong = float(torque >= 0.0) + float(drum <= 0.0)
    return [
        _check("sign", what, wrong, "", 0.0),
        _check("ratio", f"motor over drum {ratio:.2f}", off, "%", RATIO),
    ]


def _warm_up(run: StepRun) -> list[Check]:
    """Change of the friction at one speed, over the last five minutes or the time that there is."""
    held = _held(run, WARM_UP, WARM_SPEED)
    what = f"change of friction at {WARM_SPEED / RPM:.0f} rpm"
    if len(held) < FEWEST_TICKS:
        return [missing("warm-up", what, "%", FLAT, OWN)]
    time, torque = run.trace.time[held], run.trace.shaft_torque[held]
    last = time >= time[-1] - FLAT_OVER
    span = float(np.ptp(time[last]))
    slope = np.polyfit(time[last] - time[-1], torque[last], 1)[0]
    change = 100.0 * float(slope * span / torque[last].mean())
    return [_check("warm-up", f"{what} over {span:.0f} s", change, "%", FLAT)]


def _clocks(run: StepRun) -> list[Check]:
    """Heartbeat and clock of the PLC against ours."""
    elapsed = float(run.trace.time[-1] - run.trace.time[0])
    own = float(run.own_time[-1] - run.own_time[0])
    beats = float(run.heartbeat[-1] - run.heartbeat[0])
    return [
        _check(
            "heartbeat", "scans a second", 100.0 * (beats * SCAN / elapsed - 1.0), "%", HEARTBEAT
        ),
        _check("clock", "clock of the PLC against ours", 100.0 * (elapsed / own - 1.0), "%", CLOCK),
    ]
