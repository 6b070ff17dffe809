"""The parity relations: what the measured signals of a run must satisfy, block by block.

A parity relation (analytical redundancy; E. Chow, A. Willsky, IEEE Trans. Automatic Control 29
(1984) 603) holds between measured signals alone. Here it holds over each interval between two
samples, with the means of what acts in the interval (thesis, eq. 3.10, 3.20, 3.34 with the drum's
torque eliminated, and 3.1 to 3.8 solved for the reference):

    motor     J_m omega_m' - k Phi(omega_m) i - T = 0
    gear      T + (J_g omega_m'/xi + J_d omega_d' + T_f(omega_m/xi) - T_d) / xi = 0
    drive     omega_m + e - omega_ref(t - b) = 0,   e : speed error that the current tells of
    armature  u - R_a i - L_a i' - k Phi(omega_m) omega_m = 0,   where the voltage is logged

No relation needs a simulation, nor whether gear and drum touch: momentum is kept in the gap too.

The drive's relation solves both controllers backwards. The voltage u is logged, or follows from the
armature's relation. It gives i_ref = i + u/K_c - (the part that the integrator holds), and i_ref
gives e in the same way. At a limit the drive's relation says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation.measured_signals import (
    MeasuredSignals,
    interval_means,
    measured_signals,
)
from plant_emulator.errors import UnsettledError
from plant_emulator.model.array_laws import flux, gear_friction
from plant_emulator.simulation.simulate import simulate
from plant_emulator.solver import compiler

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

MOTOR, GEAR, DRIVE, ARMATURE = range(4)
# Relations of a run with its voltage; a run without it lacks the last one, the armature's.
ROWS = 4
# The drive counts as limited from this share of a limit on.
AT_LIMIT = 0.97


def delayed_reference(m: MeasuredSignals, dead_time: float) -> Array:
    """Speed reference after the dead time [rad/s] at the samples; dead_time : [s]."""
    if not m.staircase:
        return np.interp(m.time - dead_time, m.time, m.reference)
    held = np.searchsorted(m.time, m.time - dead_time, side="right") - 1
    return np.asarray(m.reference[np.maximum(held, 0)])


def gradient(channel: Array, step: Array) -> Array:
    """Slope of a channel at the samples, shape (n,); step : between them [s], shape (n - 1,).

    That of the parabola through a sample and its neighbours, as of `np.gradient`, which takes five
    times as long.
    """
    slope = np.diff(channel) / step
    inner = (slope[:-1] * step[1:] + slope[1:] * step[:-1]) / (step[1:] + step[:-1])
    return np.concatenate([slope[:1], inner, slope[-1:]])


def reconstructed_reference(
    m: MeasuredSignals, p: Mapping[str, float], nominal: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Speed reference that the drive must have had [rad/s], and whether it was limited.

    Both controllers are solved backwards, sample by sample. A limited drive says nothing of its
    reference.
    nominal : the delayed reference, for the integrators while the drive is limited [rad/s]
    """
    voltage = m.voltage
    if voltage is None:
        voltage = p["armature_resistance"] * m.current + flux(m.speed, p) * m.motor_speed
        voltage += p["armature_inductance"] * gradient(m.current, m.intervals)
    steps = np.diff(m.time, prepend=2.0 * m.time[0] - m.time[1])
    return _compile_loop()(
        voltage,
        np.ascontiguousarray(m.current),
        np.ascontiguousarray(m.motor_speed),
        steps,
        nominal,
        p["current_gain"],
        p["current_integral_time"],
        p["speed_gain"],
        p["speed_integral_time"],
        AT_LIMIT * p["armature_current_limit"],
        AT_LIMIT * p["voltage_limit"],
    )


def _solve_backwards(
    voltage: Array,
    current: Array,
    speed: Array,
    steps: Array,
    nominal: Array,
    current_gain: float,
    current_time: float,
    speed_gain: float,
    speed_time: float,
    most_current: float,
    most_voltage: float,
) -> tuple[Array, NDArray[np.bool_]]:
    """Solve both controllers backwards; see `reconstructed_reference`."""
    reconstructed = np.empty_like(voltage)
    limited = np.zeros(len(voltage), np.bool_)
    held_voltage = held_current = 0.0
    for n in range(len(voltage)):
        short = (voltage[n] - held_voltage) / (1.0 + steps[n] / current_time) / current_gain
        wanted = current[n] + short
        over = abs(wanted) > most_current
        limited[n] = over or abs(voltage[n]) > most_voltage
        error = (wanted - held_current) / (1.0 + steps[n] / speed_time) / speed_gain
        if limited[n]:
            error = nominal[n] - speed[n]
        else:
            held_voltage += steps[n] / current_time * current_gain * short
        if not over:
            held_current += steps[n] / speed_time * speed_gain * error
        reconstructed[n] = speed[n] + error
    return reconstructed, limited


@cache
def _compile_loop() -> Callable[..., tuple[Array, NDArray[np.bool_]]]:
    """Compile the loop once in this process."""
    compiler.use_cache([__file__, str(compiler.__file__)], ["reconstructed reference"])
    return compiler.compile_function(_solve_backwards, on_disk=True)


def speed_error(voltage: Array, time: Array, p: Mapping[str, float]) -> Array:
    """Speed error that the drive must have had for a small voltage more [rad/s].

    Both controllers are solved backwards, as in `reconstructed_reference`: each is the filter
    K (1 + h/T) x_n = K x_(n-1) + y_n - y_(n-1). It holds where the drive is not limited.

    voltage : shape (n, k) [V]; time : with nearly even steps h, shape (n,) [s]
    """
    from scipy.signal import lfilter

    found, step = voltage, float(np.median(np.diff(time)))
    for name in ("current", "speed"):
        gain, rate = p[f"{name}_gain"], 1.0 + step / p[f"{name}_integral_time"]
        found = lfilter([1.0, -1.0], [gain * rate, -gain], found, axis=0)
    return np.asarray(found)


def relation_count(m: MeasuredSignals) -> int:
    """Number of relations of a run: that of the armature needs its voltage."""
    return ROWS if m.voltage is not None else ARMATURE


@dataclass(frozen=True)
class WhitenedRelations:
    """The relations of a run with the factor that whitens them.

    value : shape (3 or 4, n - 1) [N m, N m, rad/s, V]
    factor : lower banded Cholesky factor of their covariance
    """

    value: Array
    factor: Array

    def whiten(self, rows: Array) -> Array:
        """Whiten columns of shape (ROWS, n - 1, k); the result has the shape (r (n - 1), k).

        Rows of relations that the run lacks are left out.
        """
        from scipy.linalg.lapack import dtbtrs

        count = len(self.value)
        # LAPACK wants each column in one piece of memory.
        stacked = rows[:count].T.copy().reshape(-1, count * rows.shape[1]).T
        return np.asarray(dtbtrs(self.factor, stacked, uplo="L", overwrite_b=True)[0])


def relation_residuals(
    m: MeasuredSignals, p: Mapping[str, float]
) -> tuple[Array, NDArray[np.bool_]]:
    """Residuals of the relations, shape (3 or 4, n - 1), and whether the drive is limited."""
    xi, step = p["gear_ratio"], m.intervals
    acceleration = np.diff(m.motor_speed) / step
    motor = p["motor_inertia"] * acceleration - interval_means(flux(m.speed, p) * m.current)
    driven = (
        p["gear_inertia"] * acceleration / xi + p["drum_inertia"] * np.diff(m.drum_speed) / step
    )
    driven += interval_means(gear_friction(m.speed / xi, p)) - m.drum_torque
    nominal = delayed_reference(m, p["dead_time"])
    reconstructed, limited = reconstructed_reference(m, p, nominal)
    rows = [
        motor - interval_means(m.torque),
        interval_means(m.torque) + driven / xi,
        interval_means(reconstructed - nominal),
    ]
    if m.voltage is not None:
        induced = p["armature_inductance"] * np.diff(m.current) / step
        emf = flux(m.speed, p) * m.motor_speed
        rows.append(
            interval_means(m.voltage - p["armature_resistance"] * m.current - emf) - induced
        )
    return np.stack(rows), limited[1:] | limited[:-1]


def simulated_relations(
    recording: Recording, p: Mapping[str, float], gap_position: float
) -> tuple[Array, NDArray[np.bool_]] | None:
    """The relations' own error between samples, and whether the simulated drive is limited.

    None: the run cannot be simulated
    p : parameter values [SI]; gap_position : at the start of the run, from -1 to 1
    """
    try:
        log = simulate(recording.inputs, p, gap_position=gap_position)
    except UnsettledError:
        return None
    m = measured_signals(replace(recording, log=log), p)
    residuals, limited = relation_residuals(replace(m, speed=m.motor_speed), p)
    residuals[DRIVE, limited] = 0.0
    return residuals, limited
