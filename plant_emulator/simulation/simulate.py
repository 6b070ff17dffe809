"""Simulates a run: the inputs of a log in, a log of simulated signals out.

`RunInputs` are prepared once and simulated many times with other values. Between samples the speed
reference is linear; in a log with a truck it is a staircase. The wheel torque of a sample acted
during the interval before the sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Literal

import numpy as np

from plant_emulator.errors import UnsettledError
from plant_emulator.signals.log import COMPARED, Array, Log
from plant_emulator.simulation.sensor_noise import SENSORS
from plant_emulator.solver.kernel import kernel_for
from plant_emulator.solver.stepper import CHANNELS, Inputs

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.solver.kernel import Kernel

Hold = Literal["linear", "staircase"]

# Error per step over the range of a full-speed run; the figures are in the README's table.
TOLERANCE = 1e-6
# At most one sample by default: the step control watches the nominal states only, not the memories
# of effects, and a run then changes smoothly with its parameters, which a fit needs. A log slower
# than 100 Hz is stepped as one of 100 Hz.
LARGEST_STEP = 0.01
# A kink of the reference that is stepped onto [rad/s^2]; smaller ones are left to the error
# control.
CORNER = 1.0
# The truck starts when its torque leaves the noise of a parked one [N m at the wheel].
WHEEL_TORQUE_STARTS = 10.0


@dataclass(frozen=True)
class RunInputs:
    """The inputs of one run as the kernel takes them, shape (n,) each but `corners`.

    truck : whether there is one; without it the drum is free and the log has no wheel torque
    interval : between most samples [s]
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


def inputs_of(log: Log, hold: Hold | None = None) -> RunInputs:
    """The inputs in a log.

    hold : what holds between samples of the reference; None: staircase with a truck, else linear
    """
    time, reference = log.time, log["speed_reference"]
    truck = "wheel_torque" in log
    staircase = (hold or ("staircase" if truck else "linear")) == "staircase"
    slope = np.zeros_like(reference)
    if staircase:
        corners = time[1:][np.diff(reference) != 0.0]
    else:
        slope[:-1] = np.diff(reference) / np.diff(time)
        corners = time[1:-1][np.abs(np.diff(slope[:-1])) > CORNER]
    wheel_torque = log["wheel_torque"] if truck else np.zeros_like(reference)
    return RunInputs(
        time=np.ascontiguousarray(time),
        reference=np.ascontiguousarray(reference),
        slope=slope,
        corners=corners,
        wheel_torque=np.ascontiguousarray(wheel_torque),
        parked=_parked(wheel_torque) if truck else np.zeros_like(reference),
        truck=truck,
        source=log.source,
        interval=float(np.median(np.diff(time))),
    )


def _parked(wheel_torque: Array) -> Array:
    """1 for the intervals before the truck's first start, in which the drum is held."""
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
    kernel: Kernel | None = None,
) -> Log:
    """Simulate a run; the log has the inputs and the channels of the bench.

    values : parameters, and those of effects as <effect>_<parameter> [SI]
    gap_position : (theta_g - theta_d) / alpha at the start, -1 to 1; +1: driving flank in contact
    largest_step : of adapted steps [s]; None: one sample of the log, at most 10 ms. Longer ones
        pass over samples: two to three times faster where reference and truck are smooth, for a
        bench without effects
    step : a fixed step [s] instead of adapted ones
    """
    model, values = (kernel, values) if kernel is not None else kernel_for(values)
    out = np.zeros((len(run.time), len(CHANNELS)))
    p = model.parameter_record(values)
    x = model.state(p, gap_position * values["backlash_half_gap"])
    if largest_step is None:
        largest_step = min(LARGEST_STEP, run.interval)
    settings = (tolerance, largest_step) if step is None else (inf, step)
    stage = model.stage_record()
    stage.truck = float(run.truck)
    model.run(
        Inputs(run.time, run.reference, run.slope, run.corners, run.wheel_torque, run.parked),
        settings,
        x,
        model.work(),
        stage,
        p,
        out,
    )
    _refuse_unsolved(run, stage.unsettled, out)
    signals = {name: out[:, k] for k, name in enumerate(CHANNELS)}
    if not run.truck:  # a log with this column would be read as a staircase with a parked truck
        del signals["wheel_torque"]
    return Log(run.time, {"speed_reference": run.reference, **signals}, run.source)


def _refuse_unsolved(run: RunInputs, unsettled: float, out: Array) -> None:
    """Raise UnsettledError for a result that is not the model's."""
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
    """One flat mapping of all values, as `simulate` takes it; the set's own effects first."""
    both = {**parameters.effects, **(effects or {})}
    flat = {f"{e}_{key}": v for e, own in both.items() for key, v in own.items()}
    return {**parameters.values(), **flat}


def mean_square_residual(measured: Log, simulated: Log) -> float:
    """Mean square of the residual in units of the sensors' noise, over the compared channels but
    the voltage, whose sensor may be off.
    """
    squares = [
        np.mean(((measured[name] - simulated[name]) / SENSORS[name][0]) ** 2)
        for name in COMPARED
        if name in measured
    ]
    return float(np.mean(squares))


def fit_start(log: Log, run: RunInputs, values: Mapping[str, float], points: int = 41) -> float:
    """Gap position at the start that fits the log best, -1 to 1.

    A scan, because the timing of the first contact makes the cost many-valleyed, then a bounded
    search in the best valley.
    """
    from scipy.optimize import minimize_scalar

    def cost(position: float) -> float:
        return mean_square_residual(
            log, simulate(run, values, gap_position=position, tolerance=1e-4)
        )

    grid = np.linspace(-1.0, 1.0, points)
    best = float(grid[np.argmin([cost(float(position)) for position in grid])])
    width = float(grid[1] - grid[0])
    bounds = (max(-1.0, best - width), min(1.0, best + width))
    found = minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-4})
    return float(found.x) if found.fun < cost(best) else best
