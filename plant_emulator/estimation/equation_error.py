"""Start values of a fit from the equations of motion alone, without any simulation.

The measured signals and their smoothed derivatives are put into two equations that are linear in
most of what they determine:

    above base speed   k Phi i = J_m omega_m' - T,  k Phi = K_1 / (K_2 + |omega_m|)
                       K_1 i - K_2 y = y |omega_m|        with y = J_m omega_m' - T
    gear in contact    -xi T = (J_d + J_g) omega_d' + (f_gc + f_g |omega_d|^delta_g) sgn omega_d

(thesis, eq. 3.10, 3.17, 3.20, 3.27, 3.34; T the sensor's torque). The exponent is scanned and the
rest solved for at each value (variable projection); least absolute deviations, because the spikes
of the backlash fit neither equation. Derivatives of noisy signals bias such a fit: it is a start,
which a fit of the simulated channels needs, since a flux too high saturates the voltage and leaves
that fit on a plateau.

The priors of the parameter set take part. The other two parameters of the friction follow the
Coulomb friction: without a prior it began several times too small, and fits from there ended in
local minima.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.smoothing import fit_parabolas

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.signals.log import Array, Log

# Smoothing before the derivative [s]; longer than the sensors' noise, shorter than a ramp.
DERIVATIVE_WINDOW = 0.25
# What counts as driven: current, drum speed, and how far the flux lies below its constant value.
LEAST_CURRENT = 4.0
LEAST_DRUM_SPEED = 0.2
WEAKENED = 0.95
# Gear and drum that differ by more than this are in the gap [rad/s at the output].
IN_CONTACT = 0.1
EXPONENTS = np.linspace(0.1, 1.5, 57)
# Time for which the errors of the equations last [s]: the smoothing and the contact that it blurs.
ERROR_TIME = 1.0
# Fewer samples than this determine nothing.
LEAST_SAMPLES = 30
REWEIGHTINGS = 30
# Scale of deviations that are all zero: its square is still a number.
SMALLEST_SCALE = 1e-100
# Relative change that ends the reweighting: densities of exponents differ by less than their priors
# tell from a tenth of a percent on.
SETTLED_CHANGE = 1e-4

FLUX = ("flux_constant_1", "flux_constant_2")
FRICTION = ("gear_coulomb_friction", "gear_viscous_friction", "gear_friction_exponent")
MECHANICAL = ("drum_inertia", *FRICTION)


def start_values(
    logs: Sequence[Log], parameters: ParameterSet, free: Collection[str]
) -> dict[str, float]:
    """Start values [SI] of the free parameters that the logs' equations determine, by name.

    parameters : values, of which those not free are believed, and the priors of the others
    """
    tables = [_table(log) for log in logs]
    common = [name for name in tables[0] if all(name in t for t in tables)]
    table = {name: np.concatenate([t[name] for t in tables]) for name in common}
    found = _flux(table, parameters, free) if "armature_current" in table else {}
    return found | _mechanical(table, parameters, free)


def _table(log: Log) -> dict[str, Array]:
    """Smoothed signals and derivatives of a log [SI], sampled four times per smoothing window.

    share : independent samples over samples there [1]
    """
    interval = float(np.median(np.diff(log.time)))
    length = max(5, 2 * round(DERIVATIVE_WINDOW / interval / 2) + 1)
    length = min(length, len(log.time) - (1 - len(log.time) % 2))
    spacing = max(1, length // 4)

    def smooth(name: str, order: int = 0) -> Array:
        whole = fit_parabolas(log[name], length, interval, order)
        return np.asarray(whole[length // 8 :: spacing])

    table = {
        "motor_speed": smooth("motor_speed"),
        "motor_acceleration": smooth("motor_speed", 1),
        "drum_speed": smooth("drum_speed"),
        "drum_acceleration": smooth("drum_speed", 1),
        "shaft_torque": smooth("shaft_torque"),
    }
    share = min(1.0, spacing * interval / ERROR_TIME)
    table["share"] = np.full(len(table["drum_speed"]), share)
    if "armature_current" in log:
        table["armature_current"] = smooth("armature_current")
    return table


def _flux(
    table: Mapping[str, Array], parameters: ParameterSet, free: Collection[str]
) -> dict[str, float]:
    """K_1 and K_2 from the field-weakened part."""
    names, values = [name for name in FLUX if name in free], parameters.values()
    speed, current = np.abs(table["motor_speed"]), table["armature_current"]
    torque = values["motor_inertia"] * table["motor_acceleration"] - table["shaft_torque"]
    part = np.abs(current) > LEAST_CURRENT
    part &= torque * np.sign(current) > 0.0
    part &= np.abs(torque) < WEAKENED * values["flux_constant"] * np.abs(current)
    if not names or part.sum() < LEAST_SAMPLES:
        return {}
    y, i, omega = torque[part], current[part], speed[part]
    columns = {"flux_constant_1": i, "flux_constant_2": -y}
    known = sum((values[n] * columns[n] for n in FLUX if n not in names), np.zeros_like(y))
    matrix = np.column_stack([columns[n] for n in names])
    share, priors = table["share"][part], _priors(names, parameters)
    solution, _ = least_absolute(matrix, y * omega - known, *priors, share)
    return _positive(names, solution)


def _mechanical(
    table: Mapping[str, Array], parameters: ParameterSet, free: Collection[str]
) -> dict[str, float]:
    """Drum inertia and friction from the samples in which the gear drives the drum."""
    names, values = [name for name in MECHANICAL if name in free], parameters.values()
    gear_speed = table["motor_speed"] / values["gear_ratio"]
    speed = table["drum_speed"]
    part = (np.abs(speed) > LEAST_DRUM_SPEED) & (np.abs(gear_speed - speed) < IN_CONTACT)
    if not names or part.sum() < LEAST_SAMPLES:
        return {}
    direction, magnitude = np.sign(speed[part]), np.abs(speed[part])
    torque = -values["gear_ratio"] * table["shaft_torque"][part]
    scanned = [name for name in names if name == "gear_friction_exponent"]
    linear = [name for name in names if name not in scanned]
    means, precisions = _priors(scanned, parameters)
    priors = _priors(linear, parameters)
    best: tuple[float, dict[str, float]] = (np.inf, {})
    for exponent in EXPONENTS if scanned else [values["gear_friction_exponent"]]:
        columns = {
            "drum_inertia": table["drum_acceleration"][part],
            "gear_coulomb_friction": direction,
            "gear_viscous_friction": direction * magnitude**exponent,
        }
        known = sum((values[n] * c for n, c in columns.items() if n not in linear), 0.0 * torque)
        matrix = np.reshape([columns[n] for n in linear], (len(linear), len(torque))).T
        solution, cost = least_absolute(matrix, torque - known, *priors, table["share"][part])
        cost += 0.5 * float(np.sum((precisions * (exponent - means)) ** 2))
        found = _positive(linear, solution)
        if cost < best[0] and len(found) == len(linear):
            best = (cost, found | dict.fromkeys(scanned, float(exponent)))
    return best[1]


def _positive(names: Sequence[str], solution: Array) -> dict[str, float]:
    """The solution by name; empty if a value is not positive."""
    if not (solution > 0.0).all():
        return {}
    return {n: float(s) for n, s in zip(names, solution, strict=True)}


def _priors(names: Sequence[str], parameters: ParameterSet) -> tuple[Array, Array]:
    """Prior means of these parameters, and one over their deviations: zero where there is none."""
    means = np.array([parameters.value(name) for name in names])
    stds = [parameters[name].std for name in names]
    return means, np.array([1.0 / std if std else 0.0 for std in stds])


def least_absolute(
    matrix: Array, target: Array, means: Array, precisions: Array, share: Array | float = 1.0
) -> tuple[Array, float]:
    """Most probable solution where deviations are Laplace's, and its negative log density.

    It is found by reweighted least squares. The scale of the deviations is their mean. What neither
    the equations nor the priors tell stays as near to the means as it can.

    matrix : shape (samples, columns), target : shape (samples,)
    means, precisions : of the solution, mean and one over the deviation of its prior, shape
        (columns,)
    share : independent samples over samples, of each or of all [1]
    """
    left: Array = target - matrix @ means
    change: Array = np.zeros_like(means)
    for _ in range(REWEIGHTINGS):
        deviation = np.abs(left - matrix @ change)
        scale = float(deviation.mean()) + SMALLEST_SCALE
        weight = np.sqrt(share / (scale * np.maximum(deviation, 1e-3 * scale)))
        rows = np.concatenate([matrix * weight[:, None], np.diag(precisions)])
        right = np.concatenate([left * weight, np.zeros_like(means)])
        before = change
        change = np.asarray(np.linalg.lstsq(rows, right, rcond=None)[0], float)
        if (np.abs(change - before) <= SETTLED_CHANGE * np.abs(means + change)).all():
            break
    scale = float(np.abs(left - matrix @ change).mean()) + SMALLEST_SCALE
    prior = 0.5 * float(np.sum((precisions * change) ** 2))
    count = float(np.broadcast_to(share, target.shape).sum())
    return means + change, count * float(np.log(scale)) + prior
