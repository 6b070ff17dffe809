"""The sensitivities of the parity relations to the nuisance parameters.

A parameter that deviates from its assumed value leaves something of the relations: the derivative
by the parameter (thesis, eq. 3.7, 3.16, 3.27, 3.34) times the deviation. Columns of these
sensitivities keep a parameter's deviation from being called a fault. The derivatives are taken at
simulated and smoothed signals; a column with a relation's own noise in it would explain that noise.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.measured_signals import MeasuredSignals, interval_means
from plant_emulator.diagnosis.localisation.parity_relations import (
    ARMATURE,
    DRIVE,
    GEAR,
    MOTOR,
    ROWS,
    delayed_reference,
    reconstructed_reference,
)
from plant_emulator.estimation.robust_scan import cauchy_loss
from plant_emulator.model.array_laws import flux

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.localisation.block_basis import BlockQuantities
    from plant_emulator.model.parameters import Parameter, ParameterSet
    from plant_emulator.signals.log import Array

# A fit without effects is believed within so many prior standard deviations.
BELIEVED_DEVIATIONS = 2.0
# Dead times that are tried [that of the set].
DEAD_TIMES = np.linspace(0.7, 1.3, 61)

Slope = dict[int, "Array"]


def sensitivities(
    m: MeasuredSignals, q: BlockQuantities, p: Mapping[str, float]
) -> dict[str, Slope]:
    """Derivatives of the relations by parameter and relation, shape (n - 1,) each.

    q : quantities inside the blocks; p : parameter values [SI]
    """
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
        "dead_time": {
            DRIVE: -interval_means(np.gradient(delayed_reference(m, p["dead_time"]), m.time))
        },
    }


def deviation_columns(
    m: MeasuredSignals, q: BlockQuantities, p: Mapping[str, float], stds: Mapping[str, float]
) -> Array:
    """Columns of the relations by the free parameters, shape (ROWS, n - 1, k).

    stds : prior standard deviations of the free parameters by name; a column is the change by one
    """
    known = sensitivities(m, q, p)
    found = np.zeros((ROWS, len(m.intervals), len(stds)))
    for column, (name, std) in enumerate(stds.items()):
        for row, slope in known[name].items():
            found[row, :, column] = std * slope
    return found


def prior_deviations(parameters: ParameterSet, free: Sequence[str]) -> dict[str, float]:
    """Prior standard deviations of the free parameters that the relations contain, by name.

    A parameter without a prior gets half of its value.
    """
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


def believed_values(
    parameters: ParameterSet, fitted: Mapping[str, float], stds: Mapping[str, float]
) -> dict[str, float]:
    """Values at which the relations are taken: the fitted ones, as far as their priors allow.

    stds : see `prior_deviations`
    """
    nominal = parameters.values()
    likely = {
        name: float(
            np.clip(
                fitted[name],
                nominal[name] - BELIEVED_DEVIATIONS * std,
                nominal[name] + BELIEVED_DEVIATIONS * std,
            )
        )
        for name, std in stds.items()
    }
    return {**nominal, **likely}


def prior_offsets(
    parameters: ParameterSet, values: Mapping[str, float], stds: Mapping[str, float]
) -> Array:
    """Distance of the priors' means from these values [prior standard deviations]."""
    return np.array([(parameters.value(n) - values[n]) / std for n, std in stds.items()])


def estimate_dead_time(
    runs: Sequence[MeasuredSignals], p: Mapping[str, float], known: Parameter
) -> float:
    """Estimate the dead time from the drive's relation, by Cauchy's loss [s].

    known : the dead time of the parameter set, with its prior
    """
    nominal, std = known.value, known.std or 0.5 * known.value
    references = [
        reconstructed_reference(m, p, delayed_reference(m, p["dead_time"]))[0] for m in runs
    ]

    def loss(factor: float) -> float:
        trial = factor * nominal
        away = 0.5 * ((trial - nominal) / std) ** 2
        return away + sum(
            cauchy_loss((reference - delayed_reference(m, trial)) / m.noise[0])
            for reference, m in zip(references, runs, strict=True)
        )

    return float(min(DEAD_TIMES, key=loss) * nominal)
