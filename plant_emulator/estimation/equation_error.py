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
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.smoothing import fit_parabolas

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from plant_emulator.signals.log import Array, Log

# Smoothing before the derivative [s]; longer than the sensors' noise, shorter than a ramp.
DERIVATIVE_WINDOW = 0.25
# What counts as driven: current, drum speed, and how far the flux lies below its constant value.
LEAST_CURRENT = 4.0
LEAST_DRUM_SPEED = 0.2
WEAKENED = 0.95
# Gear and drum that differ by more than this are in the gap [rad/s at the output].
IN_CONTACT = 0.1
EXPONENTS = np.linspace(0.1, 1.5, 29)
# Fewer samples than this determine nothing.
LEAST_SAMPLES = 30
REWEIGHTINGS = 30
# Relative change that ends the reweighting: a start needs no more.
SETTLED_CHANGE = 1e-3

FLUX = ("flux_constant_1", "flux_constant_2")
FRICTION = ("gear_coulomb_friction", "gear_viscous_friction", "gear_friction_exponent")
MECHANICAL = ("drum_inertia", *FRICTION)


def start_values(
    logs: Sequence[Log], values: Mapping[str, float], free: Collection[str]
) -> dict[str, float]:
    """Start values [SI] of the free parameters that the logs' equations determine, by name.

    values : all parameters of the bench; those not free are believed
    """
    tables = [_table(log) for log in logs]
    common = [name for name in tables[0] if all(name in t for t in tables)]
    table = {name: np.concatenate([t[name] for t in tables]) for name in common}
    found = _flux(table, values, free) if "armature_current" in table else {}
    return found | _mechanical(table, values, free)


def _table(log: Log) -> dict[str, Array]:
    """Smoothed signals and derivatives of a log [SI], sampled four times per smoothing window."""
    interval = float(np.median(np.diff(log.time)))
    length = max(5, 2 * round(DERIVATIVE_WINDOW / interval / 2) + 1)
    length = min(length, len(log.time) - (1 - len(log.time) % 2))

    def smooth(name: str, order: int = 0) -> Array:
        whole = fit_parabolas(log[name], length, interval, order)
        return np.asarray(whole[length // 8 :: max(1, length // 4)])

    table = {
        "motor_speed": smooth("motor_speed"),
        "motor_acceleration": smooth("motor_speed", 1),
        "drum_speed": smooth("drum_speed"),
        "drum_acceleration": smooth("drum_speed", 1),
        "shaft_torque": smooth("shaft_torque"),
    }
    if "armature_current" in log:
        table["armature_current"] = smooth("armature_current")
    return table


def _flux(
    table: Mapping[str, Array], values: Mapping[str, float], free: Collection[str]
) -> dict[str, float]:
    """K_1 and K_2 from the field-weakened part."""
    names = [name for name in FLUX if name in free]
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
    solution, _ = least_absolute(np.column_stack([columns[n] for n in names]), y * omega - known)
    return _positive(names, solution, values)


def _mechanical(
    table: Mapping[str, Array], values: Mapping[str, float], free: Collection[str]
) -> dict[str, float]:
    """Drum inertia and friction from the samples in which the gear drives the drum."""
    names = [name for name in MECHANICAL if name in free]
    gear_speed = table["motor_speed"] / values["gear_ratio"]
    speed = table["drum_speed"]
    part = (np.abs(speed) > LEAST_DRUM_SPEED) & (np.abs(gear_speed - speed) < IN_CONTACT)
    if not names or part.sum() < LEAST_SAMPLES:
        return {}
    direction, magnitude = np.sign(speed[part]), np.abs(speed[part])
    torque = -values["gear_ratio"] * table["shaft_torque"][part]
    scanned = "gear_friction_exponent" in free
    exponents = EXPONENTS if scanned else np.array([values["gear_friction_exponent"]])
    linear = [name for name in names if name != "gear_friction_exponent"]
    best = (np.inf, exponents[0], np.zeros(len(linear)))
    for exponent in exponents:
        columns = {
            "drum_inertia": table["drum_acceleration"][part],
            "gear_coulomb_friction": direction,
            "gear_viscous_friction": direction * magnitude**exponent,
        }
        known = sum((values[n] * c for n, c in columns.items() if n not in linear), 0.0 * torque)
        matrix = np.column_stack([columns[n] for n in linear]) if linear else None
        solution, cost = least_absolute(matrix, torque - known)
        if cost < best[0] and (solution > 0.0).all():
            best = (cost, exponent, solution)
    found = _positive(linear, best[2], values) if np.isfinite(best[0]) else {}
    return found | ({"gear_friction_exponent": float(best[1])} if scanned and found else {})


def _positive(
    names: Sequence[str], solution: Array, values: Mapping[str, float]
) -> dict[str, float]:
    """The solution by name; empty if a value is not positive."""
    if not (solution > 0.0).all():
        return {}
    return {n: float(s) for n, s in zip(names, solution, strict=True) if n in values}


def least_absolute(matrix: Array | None, target: Array) -> tuple[Array, float]:
    """Solution of smallest mean absolute deviation, and that deviation; reweighted least squares.

    matrix : shape (samples, columns), target : shape (samples,)
    """
    if matrix is None:
        return np.zeros(0), float(np.mean(np.abs(target)))
    weight = np.ones(len(target))
    solution: Array = np.zeros(matrix.shape[1])
    for _ in range(REWEIGHTINGS):
        columns = matrix * weight[:, None]
        renewed = np.asarray(np.linalg.lstsq(columns, target * weight, rcond=None)[0], float)
        deviation = np.abs(target - matrix @ renewed)
        settled = bool(np.max(np.abs(renewed - solution) - SETTLED_CHANGE * np.abs(renewed)) <= 0.0)
        solution = renewed
        if settled:
            break
        weight = 1.0 / np.sqrt(np.maximum(deviation, 1e-3 * deviation.mean() + 1e-300))
    return solution, float(np.mean(np.abs(target - matrix @ solution)))
