"""What drifting parameters do to the relations of the blocks, so that drift is not called a fault.

What is left of the relations when a free parameter is larger than assumed, by its derivative and
in standard deviations of its prior (thesis, eq. 3.7, 3.16, 3.27, 3.34). The derivatives are taken
at simulated and smoothed signals: a column with a relation's own noise in it would explain that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.parity_relations import (
    ARMATURE,
    DRIVE,
    GEAR,
    MOTOR,
    ROWS,
    Measured,
    delayed_reference,
    flux,
    middle,
    reconstructed_reference,
)
from plant_emulator.estimation.robust_scan import cauchy_loss

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.localisation.block_basis import Inside
    from plant_emulator.model.parameters import Parameter, ParameterSet
    from plant_emulator.signals.log import Array

# Prior standard deviations that a fit without effects is believed within.
WIDE = 2.0
# Dead times that are tried, over that of the set, and their prior standard deviation.
DEAD_TIMES = np.linspace(0.7, 1.3, 61)

Slope = dict[int, "Array"]


def slopes(m: Measured, q: Inside, p: Mapping[str, float]) -> dict[str, Slope]:
    """Derivatives of the relations by parameter, shape (n - 1,) each [relation over parameter]."""
    xi, speed = p["gear_ratio"], np.abs(q.speed) / p["gear_ratio"]
    k = flux(q.speed, p)
    weak = np.where(k < p["flux_constant"], 1.0, 0.0)
    by_flux = {
        "flux_constant": 1.0 - weak,
        "flux_constant_1": weak * k / p["flux_constant_1"],
        "flux_constant_2": -weak * k / (p["flux_constant_2"] + np.abs(q.speed)),
    }
    power = q.moving * speed ** p["gear_friction_exponent"]
    growth = p["gear_viscous_friction"] * power * np.log(np.maximum(speed, 1e-9))
    drum = (q.load + q.wheel_torque * p["drum_radius"] / p["wheel_radius"]) / p["drum_inertia"]
    return {
        **{n: {MOTOR: f * q.current, ARMATURE: f * q.speed} for n, f in by_flux.items()},
        "armature_resistance": {ARMATURE: q.current},
        "motor_inertia": {MOTOR: -q.acceleration},
        "gear_coulomb_friction": {GEAR: -q.moving / xi},
        "gear_viscous_friction": {GEAR: -power / xi},
        "gear_friction_exponent": {GEAR: -growth / xi},
        "drum_inertia": {GEAR: -drum / xi},
        "dead_time": {DRIVE: -middle(np.gradient(delayed_reference(m, p["dead_time"]), m.time))},
    }


def columns(m: Measured, q: Inside, p: Mapping[str, float], stds: Mapping[str, float]) -> Array:
    """One column a free parameter of the relations, in its standard deviation, (ROWS, n - 1, k).

    stds : prior standard deviations of the free parameters by name
    """
    known = slopes(m, q, p)
    found = np.zeros((ROWS, len(m.intervals), len(stds)))
    for column, (name, std) in enumerate(stds.items()):
        for row, slope in known[name].items():
            found[row, :, column] = std * slope
    return found


def priors(parameters: ParameterSet, free: Sequence[str]) -> dict[str, float]:
    """Standard deviations of those free parameters that the relations hold; no prior: a half."""
    wanted = (
        "armature_resistance",
        "flux_constant",
        "flux_constant_1",
        "flux_constant_2",
        "motor_inertia",
        "gear_coulomb_friction",
        "gear_viscous_friction",
        "gear_friction_exponent",
        "drum_inertia",
        "dead_time",
    )
    return {
        name: parameters[name].std or 0.5 * parameters.value(name)
        for name in wanted
        if name in free
    }


def assumed(
    parameters: ParameterSet, fitted: Mapping[str, float], stds: Mapping[str, float]
) -> dict[str, float]:
    """Values to take the relations at: fitted ones, as far as their priors find them likely."""
    nominal = parameters.values()
    likely = {
        name: float(np.clip(fitted[name], nominal[name] - WIDE * std, nominal[name] + WIDE * std))
        for name, std in stds.items()
    }
    return {**nominal, **likely}


def prior(
    parameters: ParameterSet, values: Mapping[str, float], stds: Mapping[str, float]
) -> Array:
    """How far the priors' means lie from these values, in standard deviations."""
    return np.array([(parameters.value(n) - values[n]) / std for n, std in stds.items()])


def dead_time(runs: Sequence[Measured], p: Mapping[str, float], known: Parameter) -> float:
    """Dead time [s] that the drive's relation tells of; outliers count by their logarithm.

    known : what is known of it beforehand
    """
    nominal, std = known.value, known.std or 0.5 * known.value
    references = [
        reconstructed_reference(m, p, delayed_reference(m, p["dead_time"]))[0] for m in runs
    ]

    def loss(factor: float) -> float:
        trial = factor * nominal
        away = 0.5 * ((trial - nominal) / std) ** 2
        return away + sum(
            cauchy_loss((t - delayed_reference(m, trial)) / m.noise[0])
            for t, m in zip(references, runs, strict=True)
        )

    return float(min(DEAD_TIMES, key=loss) * nominal)
