"""The stepper: SDIRK2, with fixed or adapted steps. It knows steps and stages, not motors.

Two-stage, singly diagonally implicit Runge-Kutta method of order 2, L-stable and stiffly accurate
(Alexander, SIAM J. Numer. Anal. 14 (1977) 1006):

    X1 = x + gamma h f(X1)
    X2 = x + (1 - gamma) h f(X1) + gamma h f(X2),   x(t + h) = X2,   gamma = 1 - 1/sqrt(2)

Each stage is X = base + a f(X) with a = gamma h; f(X1) = (X1 - x) / a, so the second base is
x + (1 - gamma)/gamma (X1 - x) and f itself is never evaluated.

Error estimate: the slopes at t, t + gamma h and t + h give a quadrature of order 3; its difference
from the method's is the local error. Where a contact closes or a limit is reached the slopes jump,
and the step shrinks. Steps end on samples and on every corner of the delayed reference. A step may
pass samples as long as the truck's torque stays; these lie on the cubic through both ends.
"""

from __future__ import annotations

from math import ceil, inf, sqrt
from typing import TYPE_CHECKING

from plant_emulator.laws import (
    dead_time,
    measured_armature_current,
    measured_drum_speed,
    measured_shaft_torque,
    shell_temperature,
)
from plant_emulator.plant import (
    GEAR_SPEED,
    MOTOR_SPEED,
    acting_wheel_torque,
    evaluate_laws,
    load,
    show,
    solve_stage,
    store,
)

if TYPE_CHECKING:
    from plant_emulator.kernel_types import Record, State

GAMMA = 1.0 - 1.0 / sqrt(2.0)
# Weights of the error estimate: order-3 quadrature at 0, gamma, 1 minus the method's.
_W1 = 1.0 / (6.0 * GAMMA * (1.0 - GAMMA))
_W2 = 0.5 - _W1 * GAMMA
ERROR_0, ERROR_1, ERROR_2 = 1.0 - _W1 - _W2, _W1 - (1.0 - GAMMA), _W2 - GAMMA

# States whose error is controlled, over the size that counts as 1: the range of a full-speed run.
CONTROLLED = (2, 3, 4, 7)
WEIGHT = (1.0 / 70.0, 1.0 / 400.0, 1.0 / 1.2e-3, 1.0 / 6.5)

SHRINK, GROW, SAFETY = 0.2, 5.0, 0.9
SMALLEST_STEP = 1e-6
# Error that a step with an unsettled stage counts as, in tolerances.
UNSETTLED = 1e6
# Below this share of the tolerance a step grows by GROW, above by the root.
EASY = (SAFETY / GROW) ** 3

# Channels of a log in the order of `observe`.
CHANNELS = (
    "motor_speed",
    "drum_speed",
    "armature_current",
    "shaft_torque",
    "armature_voltage",
    "shell_temperature",
    "wheel_torque",
)


# Rows of the work space.
FIRST, BASE, LAST, SLOPE = 0, 1, 2, 3


def step(
    h: float, t: float, r: tuple[float, float], x: State, w: State, s: Record, p: Record
) -> None:
    """One step from x at t; its result goes to w[LAST], x stays as it is.

    r : delayed reference at t + gamma h and at t + h [rad/s]
    """
    first, base, last, slope = w[FIRST], w[BASE], w[LAST], w[SLOPE]
    load(x, s)
    s.motor_speed += GAMMA * h * slope[MOTOR_SPEED]
    s.gear_speed += GAMMA * h * slope[GEAR_SPEED]
    s.time, s.delayed_reference = t + GAMMA * h, r[0]
    solve_stage(x, GAMMA * h, s, p)
    store(s, first)
    for k in range(len(x)):
        base[k] = x[k] + (1.0 - GAMMA) / GAMMA * (first[k] - x[k])
    s.motor_speed = x[MOTOR_SPEED] + (first[MOTOR_SPEED] - x[MOTOR_SPEED]) / GAMMA
    s.gear_speed = x[GEAR_SPEED] + (first[GEAR_SPEED] - x[GEAR_SPEED]) / GAMMA
    s.time, s.delayed_reference = t + h, r[1]
    solve_stage(base, GAMMA * h, s, p)
    store(s, last)


def local_error(h: float, x: State, w: State) -> float:
    """Largest local error of the controlled states, each over its scale [1]; a NaN is infinite."""
    first, base, last, slope = w[FIRST], w[BASE], w[LAST], w[SLOPE]
    per_stage, error = 1.0 / (GAMMA * h), 0.0
    for j in range(len(CONTROLLED)):
        k = CONTROLLED[j]
        slope_1 = (first[k] - x[k]) * per_stage
        slope_2 = (last[k] - base[k]) * per_stage
        size = abs(h * (ERROR_0 * slope[k] + ERROR_1 * slope_1 + ERROR_2 * slope_2)) * WEIGHT[j]
        if not size <= error:
            error = size if size > error else inf
    return error


def growth(error: float) -> float:
    """Factor to the next step after one of that error, in units of the tolerance [1]."""
    if error <= EASY:
        return GROW
    factor: float = SAFETY * error ** (-1.0 / 3.0)
    return max(SHRINK, factor)


def accept(h: float, x: State, w: State) -> None:
    """Make the step's result the state, and keep its last slope."""
    base, last, slope = w[BASE], w[LAST], w[SLOPE]
    per_stage = 1.0 / (GAMMA * h)
    for k in range(len(x)):
        slope[k] = (last[k] - base[k]) * per_stage
        x[k] = last[k]


def observe(row: int, out: State, s: Record, p: Record) -> None:
    """Write what the sensors show into one row of the log (CHANNELS)."""
    out[row, 0] = s.tachometer_gain * s.motor_speed
    out[row, 1] = measured_drum_speed(s, p)
    out[row, 2] = measured_armature_current(s, p)
    out[row, 3] = measured_shaft_torque(s, p)
    out[row, 4] = s.armature_voltage
    out[row, 5] = shell_temperature(s, p)
    out[row, 6] = acting_wheel_torque(s, p)


def segment_at(tau: float, k: int, time: State) -> int:
    """Segment of the samples that tau lies in, looked for from segment k on."""
    while k + 1 < len(time) and time[k + 1] <= tau:
        k += 1
    while k > 0 and time[k] > tau:
        k -= 1
    return k


def delayed(tau: float, k: int, time: State, value: State, slope: State) -> float:
    """Reference of segment k at the time tau, before the first sample its value [rad/s]."""
    reference: float = value[k] + slope[k] * (max(tau, time[0]) - time[k])
    return reference


def landing_sample(row: int, reach: float, time: State, wheel_torque: State, parked: State) -> int:
    """The last sample within reach, from `row` on, up to which the truck's torque stays."""
    while (
        row + 1 < len(time)
        and time[row + 1] <= reach * (1.0 + 1e-12)
        and wheel_torque[row + 1] == wheel_torque[row]
        and parked[row + 1] == parked[row]
    ):
        row += 1
    return row


def interpolate(since: float, h: float, x: State, w: State) -> State:
    """State a time `since` after the begin of the step: the cubic through both ends and slopes.

    It takes the place of the first stage, which is of no more use.
    """
    first, base, last, slope = w[FIRST], w[BASE], w[LAST], w[SLOPE]
    u = since / h
    rise, start, end = u * u * (3.0 - 2.0 * u), since * (1.0 - u) ** 2, since * u * (u - 1.0)
    per_stage = 1.0 / (GAMMA * h)
    for k in range(len(x)):
        slope_1 = (last[k] - base[k]) * per_stage
        first[k] = x[k] + rise * (last[k] - x[k]) + start * slope[k] + end * slope_1
    return first


def private(stage: Record) -> Record:
    """The record to work on: compiled, a copy that the compiler may keep in registers."""
    return stage


def publish(s: Record, stage: Record) -> None:
    """Bring the record worked on back to the caller's: nothing to do where it is the same."""


def run(
    time: State,
    value: State,
    slope: State,
    edges: State,
    wheel_torque: State,
    parked: State,
    settings: tuple[float, float],
    x: State,
    w: State,
    stage: Record,
    p: Record,
    out: State,
) -> int:
    """Simulate a whole log; returns the number of steps.

    time, value, slope : samples of the reference and its slope behind each [s, rad/s, rad/s^2]
    edges : corners of the reference before the dead time, ascending [s]
    wheel_torque, parked : in force during the interval that ends at the sample [N m, 0 or 1]
    settings : tolerance [1] (infinite: fixed steps) and largest step [s]
    x, w, stage, p : state at time[0], work space, stage and parameter records
    out : (samples, channels), filled
    """
    tolerance, largest = settings
    s, p = private(stage), private(p)
    load(x, s)
    s.time, s.delayed_reference = time[0], value[0]
    evaluate_laws(s, p)
    observe(0, out, s, p)
    t, h, segment, edge, steps, row = time[0], largest, 0, 0, 0, 1
    while row < len(time):
        s.time, s.wheel_torque, s.parked = t, wheel_torque[row], parked[row]
        b = dead_time(s, p)
        while edge < len(edges) and edges[edge] + b <= t + SMALLEST_STEP:
            edge += 1
        corner = edges[edge] + b if edge < len(edges) else inf
        reach = min(t + min(h, largest), corner + SMALLEST_STEP)
        landing = landing_sample(row, reach, time, wheel_torque, parked)
        end = corner if corner < time[landing] - SMALLEST_STEP else time[landing]
        pieces = 1 if landing > row else ceil((end - t) / min(h, largest) - 1e-9)
        length = (end - t) / pieces
        # Corners nearer than the smallest step to an end of the step lie at that end.
        early = segment_at(t + max(GAMMA * length, SMALLEST_STEP) - b, segment, time)
        segment = segment_at(t + max(length - SMALLEST_STEP, SMALLEST_STEP) - b, early, time)
        r = (
            delayed(t + GAMMA * length - b, early, time, value, slope),
            delayed(t + length - b, segment, time, value, slope),
        )
        unsettled = s.unsettled
        step(length, t, r, x, w, s, p)
        steps += 1
        if tolerance < 1e9:
            error = min(local_error(length, x, w) / tolerance, UNSETTLED)
            if s.unsettled > unsettled:  # a shorter step is nearer to where it was linearised
                error = UNSETTLED
            h = length * growth(error)
            if error > 1.0 and length > SMALLEST_STEP:
                s.unsettled = unsettled
                continue
            if s.unsettled > unsettled:
                break  # no step is short enough: the caller refuses the result
        if pieces == 1 and end == time[landing]:
            observe(landing, out, s, p)
            for k in range(row, landing):
                early = segment_at(time[k] - b, early, time)
                s.delayed_reference = delayed(time[k] - b, early, time, value, slope)
                s.time = time[k]
                show(interpolate(time[k] - t, length, x, w), s, p)
                observe(k, out, s, p)
            row = landing + 1
        accept(length, x, w)
        t = end if pieces == 1 else t + length
    publish(s, stage)
    return steps


def advance(
    references: State,
    history: State,
    newest: int,
    h: float,
    x: State,
    w: State,
    stage: Record,
    p: Record,
    out: State,
) -> int:
    """Advance the running bench by one fixed step for each reference; returns the new `newest`.

    -1 where the dead time is negative or longer than the history: the bench stops before that step.

    references : what the PLC asks at the end of each step [rad/s]
    history : ring of past references one step apart, at least dead time / h + 2 long
    out : (steps, channels), filled
    """
    s, p = private(stage), private(p)
    length = len(history)
    for row in range(len(references)):
        newest = (newest + 1) % length
        history[newest] = references[row]
        lag = dead_time(s, p) / h
        if not 0.0 <= lag <= length - 2.0:
            newest = -1
            break
        r = (
            past(lag + 1.0 - GAMMA, newest, history),
            past(lag, newest, history),
        )
        step(h, s.time, r, x, w, s, p)
        accept(h, x, w)
        observe(row, out, s, p)
    publish(s, stage)
    return newest


def past(lag: float, newest: int, history: State) -> float:
    """Reference that many steps ago, linear between the steps [rad/s]."""
    length = len(history)
    whole = int(lag)
    part = lag - whole
    young: float = history[(newest - whole) % length]
    old: float = history[(newest - whole - 1) % length]
    return (1.0 - part) * young + part * old
