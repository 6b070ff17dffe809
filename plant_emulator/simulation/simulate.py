"""Simulates a run: the inputs of a log in, a log of simulated signals out.

`RunInputs` are prepared once and simulated many times with other values. Between samples the speed
reference is linear; in a log with a truck it is a staircase. The wheel torque of a sample acted
during the interval before the sample.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, nan
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from plant_emulator.errors import UnsettledError
from plant_emulator.signals.log import KNEE, WHEEL_TORQUE, Array, Log
from plant_emulator.simulation.sensing import Sensing, reference_nodes, sensing_of
from plant_emulator.solver.kernel import kernel_for
from plant_emulator.solver.stepper import CHANNELS, NEVER, NO_STEPS, NOT_MEASURED, Inputs

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.model.sensors import Sensor
    from plant_emulator.solver.kernel import Kernel

Hold = Literal["linear", "staircase"]

# Error per step over what `sdirk.WEIGHT` allows [1].
TOLERANCE = 2e-5
# The same for a fit: it changes the residual of a log by some thousandths of the noise.
FIT_TOLERANCE = 2e-4
# Largest step [s], or one sample if that is shorter. The step control watches the nominal states,
# but not the memories of effects.
LARGEST_STEP = 0.01
# Steps of a run that are kept for others to follow, at most [per sample].
MOST_STEPS = 64
# Least change of the slope of the reference that ends a step [rad/s^2]. The error control handles
# smaller ones.
CORNER = 1.0
# A truck has started when its torque exceeds the noise of a parked truck [N m at the wheel].
WHEEL_TORQUE_STARTS = 10.0


@dataclass(frozen=True, kw_only=True)
class MeasuredSpeeds:
    """Speeds that a simulation is led along, as an observer is; see `solver.observer`.

    motor_speed, drum_speed : of the samples of the run; NaN: not measured [rad/s], shape (n,)
    interval : the speeds are corrected at the first sample of each such interval [s]
    """

    motor_speed: Array
    drum_speed: Array
    interval: float


@dataclass(frozen=True)
class RunInputs:
    """The inputs of one run as the kernel takes them, shape (n,) each except `corners`.

    The arrays are those of `stepper.Inputs`.

    truck : whether a truck is on the drum; without a truck the log has no wheel torque
    source : name of the run in messages; interval : median time between samples [s]
    sensing : what the declared sensors show; None: every value shows its quantity at once
    nodes : times [s] and values [rad/s] of a reference with knees between the samples
    """

    time: Array
    reference: Array
    slope: Array
    corners: Array
    wheel_torque: Array
    parked: Array
    truck: bool
    source: str
    interval: float
    sensing: Sensing | None = None
    nodes: tuple[Array, Array] | None = None


def inputs_of(
    log: Log, hold: Hold | None = None, sensors: Mapping[str, Sensor] | None = None
) -> RunInputs:
    """The inputs of a run, from the speed reference and the wheel torque of its log.

    hold : form of the reference between samples; None: staircase in a log with a truck, else linear
    sensors : declared sensors by channel
    """
    time, reference = log.time, log["speed_reference"]
    truck = WHEEL_TORQUE in log
    staircase = (hold or ("staircase" if truck else "linear")) == "staircase" and KNEE not in log
    slope = np.zeros_like(reference)
    nodes = reference_nodes(log)
    if staircase:
        corners = time[1:][np.diff(reference) != 0.0]
    else:
        slope[:-1] = np.diff(reference) / np.diff(time)
        bends = np.abs(np.diff(np.diff(nodes[1]) / np.diff(nodes[0])))
        corners = nodes[0][1:-1][bends > CORNER]
    wheel_torque = log[WHEEL_TORQUE] if truck else np.zeros_like(reference)
    return RunInputs(
        time=np.ascontiguousarray(time),
        reference=np.ascontiguousarray(reference),
        slope=slope,
        corners=corners,
        wheel_torque=np.ascontiguousarray(wheel_torque),
        parked=_mark_parked(wheel_torque) if truck else np.zeros_like(reference),
        truck=truck,
        source=log.source,
        interval=float(np.median(np.diff(time))),
        sensing=sensing_of(log, sensors or {}),
        nodes=nodes if KNEE in log else None,
    )


def refine_inputs(run: RunInputs) -> RunInputs:
    """The inputs at the finer samples that knees of the reference and lags of sensors need."""
    if run.sensing is None:
        return run
    fine, rows = run.sensing.time, run.sensing.rows
    places = np.arange(len(fine))
    before = np.searchsorted(rows, places, side="right") - 1
    ending = np.searchsorted(rows, places)
    if run.nodes is None:
        slope = run.slope[before]
        reference = run.reference[before] + slope * (fine - run.time[before])
    else:
        reference = np.interp(fine, *run.nodes)
        slope = np.append(np.diff(reference) / np.diff(fine), 0.0)
    return replace(
        run,
        time=fine,
        reference=reference,
        slope=slope,
        wheel_torque=run.wheel_torque[ending],
        parked=run.parked[ending],
    )


def _mark_parked(wheel_torque: Array) -> Array:
    """1 for the intervals before the truck's first start, in which it holds the drum; else 0."""
    started = np.abs(wheel_torque) > WHEEL_TORQUE_STARTS
    first = int(np.argmax(started)) if started.any() else len(started)
    return (np.arange(len(wheel_torque)) < first).astype(float)


def simulate(
    run: RunInputs,
    values: Mapping[str, float],
    *,
    gap_position: float = 0.0,
    tolerance: float = TOLERANCE,
    largest_step: float | None = None,
    step: float | None = None,
    along: MeasuredSpeeds | None = None,
    kernel: Kernel | None = None,
) -> Log:
    """Simulate a run; the resulting log has the inputs and all channels of the bench [SI].

    values : parameters of the bench, and of effects as <effect>_<parameter> [SI]
    gap_position : start in the backlash gap (theta_g - theta_d) / alpha, -1 to 1 [1]; at +1 the
        driving flank is in contact
    tolerance : error per step over what `sdirk.WEIGHT` allows of each state [1]
    largest_step : largest adapted step [s]; None: one sample of the log, at most 10 ms. Longer
        steps pass over samples. Without effects they make smooth runs two to three times faster.
    step : a fixed step in place of adapted steps [s]. Either may be a twentieth longer to a sample
    along : measured speeds to lead the simulation along; None: it runs freely
    kernel : the kernel to use; None: the smallest that has the effects
    Raises ParameterError for a name in `values` that is no parameter, and UnsettledError where the
    equations were not solved.
    """
    if step is not None:
        tolerance, largest_step = inf, step
    settings = Settings(gap_position, tolerance, largest_step, along)
    return _simulate(run, values, settings, kernel)[0]


class Settings(NamedTuple):
    """How a run is simulated; see `simulate`.

    follow : steps of a run with other values, see `simulate_with_steps`; empty: they are adapted
    """

    gap_position: float
    tolerance: float
    largest_step: float | None
    along: MeasuredSpeeds | None = None
    follow: Array = NO_STEPS


def simulate_with_steps(
    run: RunInputs, values: Mapping[str, float], settings: Settings
) -> tuple[Log, Array]:
    """Simulate as `simulate` does, and give the steps too, for runs with other values to follow.

    Where there were too many of them, or the run followed others itself, the result has none, and
    runs that are to follow them adapt their own.
    """
    return _simulate(run, values, settings, None, most=0 if len(settings.follow) else MOST_STEPS)


def _simulate(
    run: RunInputs,
    values: Mapping[str, float],
    settings: Settings,
    kernel: Kernel | None,
    most: int = 0,
) -> tuple[Log, Array]:
    """The log of a run, and its steps if there are no more of them than `most` a sample."""
    model, values = (kernel, values) if kernel is not None else kernel_for(values)
    coarse, run = run, refine_inputs(run)
    out, taken = np.zeros((len(run.time), len(CHANNELS))), np.empty((most * len(run.time), 2))
    p = model.parameter_record(values)
    x = model.state(p, settings.gap_position * values["backlash_half_gap"])
    largest_step = settings.largest_step
    if largest_step is None:
        largest_step = min(LARGEST_STEP, run.interval)
    stage = model.stage_record()
    stage.truck = float(run.truck)
    due, motor_speed, drum_speed = _corrections(coarse, run, settings.along)
    steps = model.run(
        Inputs(
            run.time,
            run.reference,
            run.slope,
            run.corners,
            run.wheel_torque,
            run.parked,
            due,
            motor_speed,
            drum_speed,
            settings.follow,
        ),
        (inf if len(settings.follow) else settings.tolerance, largest_step),
        x,
        model.work(),
        taken,
        stage,
        p,
        out,
    )
    _refuse_unsolved(run, stage.unsettled, out)
    signals = {name: out[:, k] for k, name in enumerate(CHANNELS)}
    if run.sensing is not None:
        signals = {name: run.sensing.show(name, values) for name, values in signals.items()}
    if not run.truck:  # a log with this column would be read as a staircase with a parked truck
        del signals["wheel_torque"]
    log = Log(coarse.time, {"speed_reference": coarse.reference, **signals}, run.source)
    return log, taken[:steps].copy() if steps <= len(taken) else NO_STEPS


def _corrections(
    coarse: RunInputs, run: RunInputs, along: MeasuredSpeeds | None
) -> tuple[Array, Array, Array]:
    """Samples to correct the speeds at, and the measured speeds, as `stepper.Inputs` has them.

    coarse, run : inputs at the samples of the log, and at those that are simulated
    along : None: none, for a free run
    """
    if along is None:
        return NEVER, NOT_MEASURED, NOT_MEASURED
    rows = np.arange(len(run.time)) if run.sensing is None else run.sensing.rows
    passed = np.floor((coarse.time - coarse.time[0]) / along.interval)
    due = rows[1:][np.diff(passed) > 0.0]
    motor, drum = np.full((2, len(run.time)), nan)
    motor[rows] = _without_lag(coarse, "motor_speed", along.motor_speed)
    drum[rows] = _without_lag(coarse, "drum_speed", along.drum_speed)
    return np.append(due, len(run.time)), motor, drum


def _without_lag(run: RunInputs, channel: str, measured: Array) -> Array:
    """The measured values, earlier by the lag that the channel's declared sensor has."""
    sensor = None if run.sensing is None else run.sensing.sensors.get(channel)
    known = np.isfinite(measured)
    if sensor is None or not known.any():
        return measured
    earlier = np.interp(run.time + sensor.time_constant, run.time[known], measured[known])
    return np.where(known, earlier, nan)


def _refuse_unsolved(run: RunInputs, unsettled: float, out: Array) -> None:
    """Raise UnsettledError for a run whose equations were not solved, or that is not finite."""
    if unsettled > 0.0:
        raise UnsettledError(
            f"{run.source}: {unsettled:.0f} implicit stages did not settle; the result is not the "
            "model's; a shorter step or other effects may help"
        )
    if not np.isfinite(out).all():
        row, column = np.argwhere(~np.isfinite(out))[0]
        raise UnsettledError(
            f"{run.source}: {CHANNELS[column]} at {run.time[row]:g} s is not finite; the result is "
            "not the model's; other parameters or effects may help"
        )


def values_of(
    parameters: ParameterSet, effects: Mapping[str, Mapping[str, float]] | None = None
) -> dict[str, float]:
    """All values as `simulate` takes them [SI]; `effects` replace effects of the set."""
    both = {**parameters.effects, **(effects or {})}
    flat = {f"{e}_{key}": v for e, table in both.items() for key, v in table.items()}
    return {**parameters.values(), **flat}
