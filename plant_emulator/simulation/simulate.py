"""Simulates a run: the inputs of a log in, a log of simulated signals out.

`RunInputs` are prepared once and simulated many times with other values. Values of effects may vary
along a run; see `Settings.factors`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from plant_emulator.errors import UnsettledError
from plant_emulator.signals.log import Array, Log
from plant_emulator.simulation.run_inputs import refine_inputs
from plant_emulator.solver.kernel import kernel_for
from plant_emulator.solver.stepper import CHANNELS, NEVER, NO_STEPS, NOT_MEASURED, Inputs

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.simulation.run_inputs import RunInputs
    from plant_emulator.solver.kernel import Kernel

# Error per step over what `sdirk.WEIGHT` allows [1].
TOLERANCE = 2e-5
# The same for a fit: it changes the residual of a log by some thousandths of the noise.
FIT_TOLERANCE = 2e-4
# Largest step [s], or one sample if that is shorter. The step control watches the nominal states,
# but not the memories of effects.
LARGEST_STEP = 0.01
# Steps of a run that are kept for others to follow, at most [per sample].
MOST_STEPS = 64
# Samples over which a value that varies keeps its mean: a law that depends on a speed or a torque
# changes little over them, and each change ends a step.
KEPT_SAMPLES = 10


@dataclass(frozen=True, kw_only=True)
class MeasuredSpeeds:
    """Speeds that a simulation is led along, as an observer is; see `solver.observer`.

    motor_speed, drum_speed : of the samples of the run; NaN: not measured [rad/s], shape (n,)
    interval : the speeds are corrected at the first sample of each such interval [s]
    dead_zones : misses of motor and drum speed that correct nothing [rad/s], shape (2,)
    """

    motor_speed: Array
    drum_speed: Array
    interval: float
    dead_zones: Array


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
    factors : by name of an effect's parameter: factor on the distance of its value from neutral at
        each sample of the log, shape (n,). A neutral effect stays neutral
    """

    gap_position: float
    tolerance: float
    largest_step: float | None
    along: MeasuredSpeeds | None = None
    follow: Array = NO_STEPS
    factors: Mapping[str, Array] = MappingProxyType({})


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
    work, stage = model.work(), model.stage_record()
    stage.truck = float(run.truck)
    largest_step = settings.largest_step
    if largest_step is None:
        largest_step = min(LARGEST_STEP, run.interval)
    tolerance = inf if len(settings.follow) else settings.tolerance
    corrections = _corrections(coarse, run, settings.along)
    first, steps = 0, 0
    neutral = model.neutral_values
    factors = {name: own for name, own in settings.factors.items() if name in neutral}
    for end, varied in _pieces(coarse, run, factors):
        for name, factor in varied.items():
            setattr(p, name, neutral[name] + (values[name] - neutral[name]) * factor)
        inputs = Inputs(
            run.time[: end + 1],
            run.reference,
            run.slope,
            run.corners,
            run.wheel_torque,
            run.parked,
            *corrections,
            settings.follow,
        )
        own = (tolerance, largest_step, first)
        steps += model.run(inputs, own, x, work, taken[steps:], stage, p, out)
        first = end
    _refuse_unsolved(run, stage.unsettled, out)
    signals = {name: out[:, k] for k, name in enumerate(CHANNELS)}
    if run.sensing is not None:
        signals = {name: run.sensing.show(name, values) for name, values in signals.items()}
    if not run.truck:  # a log with this column would be read as a staircase with a parked truck
        del signals["wheel_torque"]
    log = Log(coarse.time, {"speed_reference": coarse.reference, **signals}, run.source)
    return log, taken[:steps].copy() if steps <= len(taken) else NO_STEPS


def _pieces(
    coarse: RunInputs, run: RunInputs, factors: Mapping[str, Array]
) -> Iterator[tuple[int, Mapping[str, float]]]:
    """The last sample of each piece of a run, and the factors of what varies in it, by name.

    coarse, run : inputs at the samples of the log, and at those that are simulated
    """
    if not factors:
        yield len(run.time) - 1, {}
        return
    rows = np.arange(len(run.time)) if run.sensing is None else run.sensing.rows
    last = len(coarse.time) - 1
    for begin in range(0, last, KEPT_SAMPLES):
        end = min(begin + KEPT_SAMPLES, last)
        means = {name: float(np.mean(own[begin:end])) for name, own in factors.items()}
        yield int(rows[end]), means


def _corrections(
    coarse: RunInputs, run: RunInputs, along: MeasuredSpeeds | None
) -> tuple[Array, Array, Array, Array]:
    """Samples to correct the speeds at, the measured speeds and dead zones; see `stepper.Inputs`.

    coarse, run : inputs at the samples of the log, and at those that are simulated
    along : None: none, for a free run
    """
    if along is None:
        return NEVER, NOT_MEASURED, NOT_MEASURED, NOT_MEASURED
    rows = np.arange(len(run.time)) if run.sensing is None else run.sensing.rows
    passed = np.floor((coarse.time - coarse.time[0]) / along.interval)
    due = rows[1:][np.diff(passed) > 0.0]
    motor, drum = np.full((2, len(run.time)), nan)
    motor[rows] = _without_lag(coarse, "motor_speed", along.motor_speed)
    drum[rows] = _without_lag(coarse, "drum_speed", along.drum_speed)
    return np.append(due, len(run.time)), motor, drum, along.dead_zones


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
