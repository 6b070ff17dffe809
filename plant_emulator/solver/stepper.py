"""The stepper: SDIRK3 over a whole log, with fixed or adapted steps. `sdirk` is one step.

Steps end on samples and on every corner of the delayed reference. The step after a corner is as
long as the one that the corner before allowed, because one corner is like the next. A step may pass
samples while neither the truck's torque nor the dead time changes. The states at these samples come
from cubic interpolation.

A run may follow the steps of another one. A small change of a parameter then changes the result
smoothly, and steps of its own would not (internal numerical differentiation: H. G. Bock, in
Modelling of Chemical Reaction Systems, Springer (1981) 102). A run may also be led along a measured
one, see `observer`.
"""

from __future__ import annotations

from math import ceil, inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from plant_emulator.model.implicit_stage import acting_wheel_torque, evaluate_laws, load, show
from plant_emulator.model.laws import (
    dead_time,
    measured_armature_current,
    measured_drum_speed,
    measured_shaft_torque,
    shell_temperature,
)
from plant_emulator.solver.dead_time import (
    past_reference,
    reference_at,
    segment_at,
    stage_references,
)
from plant_emulator.solver.observer import correct
from plant_emulator.solver.sdirk import (
    GAMMA,
    MIDDLE,
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

# Channels of a simulated log, in the order that `observe` writes them.
CHANNELS = (
    "motor_speed",
    "drum_speed",
    "armature_current",
    "shaft_torque",
    "armature_voltage",
    "shell_temperature",
    "wheel_torque",
)

# Corrections of a free run: the first one is due past its last sample.
NEVER, NOT_MEASURED = np.array([np.iinfo(np.int64).max]), np.empty(0)
# Steps of a run that adapts its own, and of a run whose steps nobody wants.
NO_STEPS = np.empty((0, 2))
# A step to a sample or a corner may be longer by this share than the error control allows: two
# steps of half the length would cost twice the time. It is below what the SAFETY of the control
# leaves, so that a refused step still becomes shorter.
STRETCH = 0.05


class Inputs(NamedTuple):
    """The inputs of a log: one value a sample, but for the corners.

    The piece of a log to simulate ends with the last one of `time`; the others may go on.

    reference, slope : reference of the PLC [rad/s], and its slope until the next sample [rad/s^2]
    corners : times of the corners of the reference, before the dead time, ascending [s]
    wheel_torque : torque of the truck at its wheel in the interval that ends at the sample [N m]
    parked : 1 for an interval in which the truck is parked, else 0
    corrections : samples to correct the speeds at, ascending; then one past the last sample
    motor_speed, drum_speed : measured, for these corrections; NaN: not measured [rad/s]
    dead_zones : misses of motor and drum speed that correct nothing [rad/s], shape (2,)
    steps : begin and length of the steps to follow [s], shape (steps, 2); empty: they are adapted
    """

    time: State
    reference: State
    slope: State
    corners: State
    wheel_torque: State
    parked: State
    corrections: State = NEVER
    motor_speed: State = NOT_MEASURED
    drum_speed: State = NOT_MEASURED
    dead_zones: State = NOT_MEASURED
    steps: State = NO_STEPS


def observe(row: int, out: State, s: Record, p: Record) -> None:
    """Write the values that the sensors show into one row of the log (CHANNELS)."""
    out[row, 0] = s.tachometer_gain * s.motor_speed
    out[row, 1] = measured_drum_speed(s, p)
    out[row, 2] = measured_armature_current(s, p)
    out[row, 3] = measured_shaft_torque(s, p)
    out[row, 4] = s.armature_voltage
    out[row, 5] = shell_temperature(s, p)
    out[row, 6] = acting_wheel_torque(s, p)


def begin(time: float, reference: float, out: State, x: State, s: Record, p: Record) -> None:
    """Write the first sample to the log, at the state x and that reference [rad/s]."""
    load(x, s)
    s.time, s.delayed_reference = time, reference
    evaluate_laws(s, p)
    observe(0, out, s, p)


def begin_or_go_on(
    first: int, inputs: Inputs, out: State, x: State, s: Record, p: Record
) -> tuple[int, int, int, int, int]:
    """Begin a run, or find the places in the inputs from which it goes on after its sample `first`.

    They are those of the segment between samples, of the next corner, of the next correction and
    its last sample before, and of the step to follow.
    """
    time, value, _, edges, _, _, corrections, _, _, _, given = inputs
    if first == 0:
        begin(time[0], value[0], out, x, s, p)
        return 0, 0, 0, 0, 0
    s.time = time[first]
    corner = int(np.searchsorted(edges, time[first] - dead_time(s, p)))
    due = int(np.searchsorted(corrections, first + 1))
    corrected = int(corrections[due - 1]) if due > 0 else 0
    followed = int(np.searchsorted(given[:, 0], time[first]))
    return first, corner, due, corrected, max(0, followed - 1)


def landing_sample(
    row: int,
    reach: float,
    b: float,
    time: State,
    wheel_torque: State,
    parked: State,
    s: Record,
    p: Record,
) -> int:
    """Last sample before the time `reach` [s], from `row` on, with the truck's torque unchanged.

    The dead time there is b [s] too, because a step has one dead time. The samples' times are
    written to s.
    """
    while (
        row + 1 < len(time)
        and time[row + 1] <= reach * (1.0 + 1e-12)
        and wheel_torque[row + 1] == wheel_torque[row]
        and parked[row + 1] == parked[row]
    ):
        s.time = time[row + 1]
        if dead_time(s, p) != b:
            break
        row += 1
    return row


def private_copy(stage: Record) -> Record:
    """The record to work on; compiled, it is a copy that may live in registers."""
    return stage


def write_back(s: Record, stage: Record) -> None:
    """Copy the record worked on back to the caller's; uncompiled, both are the same record."""


def next_corner(edge: int, now: float, edges: State) -> int:
    """Index of the first corner after the time `now` [s]; the search begins at `edge`."""
    while edge < len(edges) and edges[edge] <= now + SMALLEST_STEP:
        edge += 1
    return edge


def step_to_follow(k: int, now: float, steps: State) -> int:
    """Index of the step to follow at the time `now` [s]; the search begins at k.

    It is the one of which most is still to come: a corner moves with the dead time.
    """
    while k + 1 < len(steps) and steps[k, 0] + 0.5 * steps[k, 1] <= now:
        k += 1
    return k


def step_error(length: float, tolerance: float, unsettled: bool, x: State, w: State) -> float:
    """Error of a step, in tolerances [1]; an unsolved stage counts as UNSETTLED."""
    if unsettled:  # in a shorter step the linearisations hold better
        return UNSETTLED
    return min(local_error(length, x, w) / tolerance, UNSETTLED)


def run(
    inputs: Inputs,
    settings: tuple[float, float, int],
    x: State,
    w: State,
    taken: State,
    stage: Record,
    p: Record,
    out: State,
) -> int:
    """Simulate a log, or one more piece of it, and return the number of steps.

    settings : tolerance [1], infinite for steps that are fixed or followed; largest step [s]; the
        sample that x and stage belong to: 0, or one that an earlier call has ended at
    x, w : state at that sample, work space; stage, p : stage record and parameter record
    taken : begin and length of the first steps [s], shape (some steps, 2); it is filled
    out : the channels at every sample, shape (samples, channels); it is filled
    """
    time, value, slope, edges, wheel_torque, parked, corrections, motor, drum, zones, given = inputs
    tolerance, largest, first = settings
    s, p = private_copy(stage), private_copy(p)
    segment, edge, due, corrected, k = begin_or_go_on(first, inputs, out, x, s, p)
    t, h, steps, row = time[first], largest, 0, first + 1
    past_corner, after_corner = False, largest
    while row < len(time):
        s.time, s.wheel_torque, s.parked = t, wheel_torque[row], parked[row]
        b = dead_time(s, p)
        edge = next_corner(edge, t - b, edges)
        k = step_to_follow(k, t, given)
        h = min(given[k, 1] if len(given) > 0 else h, largest)
        # These lines are no function: a call with all these arrays costs a twelfth of a run.
        corner = edges[edge] + b if edge < len(edges) else inf
        reach = min(t + h, corner + SMALLEST_STEP)
        landing = min(
            landing_sample(row, reach, b, time, wheel_torque, parked, s, p), corrections[due]
        )
        end = corner if corner < time[landing] - SMALLEST_STEP else time[landing]
        pieces = 1 if landing > row else max(1, ceil((end - t) / h - STRETCH))
        length = (end - t) / pieces
        segment, r = stage_references(t, length, b, segment, time, value, slope)
        unsettled = s.unsettled
        step(length, t, r, x, w, s, p)
        if tolerance < 1e9:
            error = step_error(length, tolerance, s.unsettled > unsettled, x, w)
            h = length * growth(error)
            if error > 1.0 and length > SMALLEST_STEP:
                s.unsettled = unsettled
                continue
            if s.unsettled > unsettled:
                break  # even the smallest step is not solved: the caller refuses the result
        after_corner = h if past_corner else after_corner
        past_corner = t + length >= corner - SMALLEST_STEP
        h = min(h, after_corner) if past_corner else h
        if steps < len(taken):
            taken[steps, 0], taken[steps, 1] = t, length
        steps += 1
        if pieces == 1 and end == time[landing]:
            observe(landing, out, s, p)
            early = segment
            for passed in range(row, landing):
                early = segment_at(time[passed] - b, early, time)
                s.time, s.delayed_reference = (
                    time[passed],
                    reference_at(time[passed] - b, early, time, value, slope),
                )
                show(interpolate(time[passed] - t, length, x, w), s, p)
                observe(passed, out, s, p)
            row = landing + 1
        accept(length, x, w)
        if row > corrections[due]:
            correct(corrected + 1, landing, (motor, drum, zones), out, x, s, p)
            due, corrected = due + 1, landing
        t = end if pieces == 1 else t + length
    write_back(s, stage)
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
    """Advance the running bench by one fixed step for each reference; return the new `newest`.

    The result is -1 if the dead time is negative or longer than the history. The bench then stops
    before that step.

    references : reference of the PLC at the end of each step [rad/s]
    history : ring of past references one step apart, at least dead time / h + 2 long [rad/s]
    newest : index of the latest reference in the ring; h : length of a step [s]
    x, w : state, work space; stage, p : stage record and parameter record
    out : the channels after every step, shape (steps, channels); it is filled
    """
    s, p = private_copy(stage), private_copy(p)
    length = len(history)
    for row in range(len(references)):
        newest = (newest + 1) % length
        history[newest] = references[row]
        lag = dead_time(s, p) / h
        if not 0.0 <= lag <= length - 2.0:
            newest = -1
            break
        r = (
            past_reference(lag + 1.0 - GAMMA, newest, history),
            past_reference(lag + 1.0 - MIDDLE, newest, history),
            past_reference(lag, newest, history),
        )
        step(h, s.time, r, x, w, s, p)
        accept(h, x, w)
        observe(row, out, s, p)
    write_back(s, stage)
    return newest
