"""Inputs of a run, as the simulation takes them from a log.

Between samples the speed reference is linear; in a log with a truck it is a staircase. The wheel
torque of a sample acted during the interval before the sample.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from plant_emulator.signals.log import KNEE, WHEEL_TORQUE
from plant_emulator.simulation.sensing import Sensing, reference_nodes, sensing_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.model.sensors import Sensor
    from plant_emulator.signals.log import Array, Log

Hold = Literal["linear", "staircase"]

# Least change of the slope of the reference that ends a step [rad/s^2]. The error control handles
# smaller ones.
CORNER = 1.0
# A truck has started when its torque exceeds the noise of a parked truck [N m at the wheel].
WHEEL_TORQUE_STARTS = 10.0


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
