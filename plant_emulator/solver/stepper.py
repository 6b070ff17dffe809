"""The stepper: SDIRK2 over a log, with fixed or adapted steps. It knows steps, not motors.

Steps end on samples and on every corner of the delayed reference. A step may pass samples as long
as the truck's torque stays; these lie on the cubic through both ends. What one step is: `sdirk`.
"""

from __future__ import annotations

from math import ceil, inf
from typing import TYPE_CHECKING

from plant_emulator.model.implicit_stage import acting_wheel_torque, evaluate_laws, load, show
from plant_emulator.model.laws import (
    dead_time,
    measured_armature_current,
    measured_drum_speed,
    measured_shaft_torque,
    shell_temperature,
)
from plant_emulator.solver.dead_time import ahead, delayed, past, segment_at
from plant_emulator.solver.sdirk import (
    GAMMA,
    SMALLEST_STEP,
    UNSETTLED,
    accept,
    growth,
    interpolate,
    local_error,
    step,
)

if TYPE_CHECKING:
    from plant_emulator.model.records import Record, State

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


def observe(row: int, out: State, s: Record, p: Record) -> None:
    """Write what the sensors show into one row of the log (CHANNELS)."""
    out[row, 0] = s.tachometer_gain * s.motor_speed
    out[row, 1] = measured_drum_speed(s, p)
    out[row, 2] = measured_armature_current(s, p)
    out[row, 3] = measured_shaft_torque(s, p)
    out[row, 4] = s.armature_voltage
    out[row, 5] = shell_temperature(s, p)
    out[row, 6] = acting_wheel_torque(s, p)


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


def private(stage: Record) -> Record:
    """The record to work on: compiled, a copy that the compiler may keep in registers."""
    return stage


def publish(s: Record, stage: Record) -> None:
    """Bring the record worked on back to the caller's: nothing to do where it is the same."""


def pending(edge: int, now: float, edges: State) -> int:
    """The first corner after the time `now` of the reference, from that corner on."""
    while edge < len(edges) and edges[edge] <= now + SMALLEST_STEP:
        edge += 1
    return edge


def error_of(length: float, tolerance: float, unsettled: bool, x: State, w: State) -> float:
    """Error of a step in tolerances; one that did not settle is to be shortened."""
    if unsettled:  # a shorter step is nearer to where it was linearised
        return UNSETTLED
    return min(local_error(length, x, w) / tolerance, UNSETTLED)


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
        edge = pending(edge, t - b, edges)
        h = min(h, largest)
        # Four lines that as a function of all these arrays would cost a twelfth of a run.
        corner = edges[edge] + b if edge < len(edges) else inf
        reach = min(t + h, corner + SMALLEST_STEP)
        landing = landing_sample(row, reach, time, wheel_torque, parked)
        end = corner if corner < time[landing] - SMALLEST_STEP else time[landing]
        pieces = 1 if landing > row else ceil((end - t) / h - 1e-9)
        length = (end - t) / pieces
        segment, r = ahead(t, length, b, segment, time, value, slope)
        unsettled = s.unsettled
        step(length, t, r, x, w, s, p)
        steps += 1
        if tolerance < 1e9:
            error = error_of(length, tolerance, s.unsettled > unsettled, x, w)
            h = length * growth(error)
            if error > 1.0 and length > SMALLEST_STEP:
                s.unsettled = unsettled
                continue
            if s.unsettled > unsettled:
                break  # no step is short enough: the caller refuses the result
        if pieces == 1 and end == time[landing]:
            observe(landing, out, s, p)
            early = segment
            for k in range(row, landing):
                early = segment_at(time[k] - b, early, time)
                s.time, s.delayed_reference = (
                    time[k],
                    delayed(time[k] - b, early, time, value, slope),
                )
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
