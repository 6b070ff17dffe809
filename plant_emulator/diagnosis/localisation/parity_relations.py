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

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.log import VOLTAGE
from plant_emulator.solver import compiler

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

MOTOR, GEAR, DRIVE, ARMATURE = range(4)
# Relations of a run with its voltage; a run without it lacks the last one, the armature's.
ROWS = 4
NOISES = ("motor_speed", "drum_speed", "armature_current", "shaft_torque", VOLTAGE)
# A difference of two samples is a jump from so many deviations of the noise on.
JUMP_NOISES = 3.0 * np.sqrt(2.0)
# Below this speed the sign of the motion and the friction are open [rad/s]: four deviations of the
# smoothed motor speed.
STILL_SPEED = 0.6
# The drive counts as limited from this share of a limit on.
AT_LIMIT = 0.97
# Variance that makes a relation count for nothing.
VOID_VARIANCE = 1e6


def interval_means(channel: Array) -> Array:
    """Means of a channel over the intervals, shape (n - 1, ...)."""
    return np.asarray(0.5 * (channel[1:] + channel[:-1]))


def flux(speed: Array, p: Mapping[str, float]) -> Array:
    """Flux k Phi at a motor speed [N m/A] (thesis, eq. 3.16 to 3.18)."""
    weakened = p["flux_constant_1"] / (p["flux_constant_2"] + np.abs(speed))
    return np.asarray(np.minimum(p["flux_constant"], weakened))


def base_speed(p: Mapping[str, float]) -> float:
    """Motor speed above which the field is weakened [rad/s] (thesis, eq. 3.18)."""
    return p["flux_constant_1"] / p["flux_constant"] - p["flux_constant_2"]


def friction(speed: Array, p: Mapping[str, float]) -> Array:
    """Friction torque of the gear [N m] at the speed of its output [rad/s] (thesis, eq. 3.27)."""
    rest = p["gear_viscous_friction"] * np.abs(speed) ** p["gear_friction_exponent"]
    return np.asarray((p["gear_coulomb_friction"] + rest) * np.sign(speed))


def jump_variance(channel: Array, deviation: float) -> Array:
    """Variance of the mean of two samples as a mean over their interval, where the channel jumps.

    jump^2 / 12,   as if the jump came at any time of the interval

    deviation : of the channel's noise
    """
    step = np.diff(channel)
    return np.where(np.abs(step) > JUMP_NOISES * deviation, step**2 / 12.0, 0.0)


@dataclass(frozen=True)
class MeasuredSignals:
    """The measured signals of a run [SI], shape (n,) each.

    staircase : whether the reference stands between its samples; else it is linear
    voltage : of the armature; None: not logged
    noise : standard deviations in the order of NOISES
    speed : motor speed, smoothed
    drum_torque : of the truck over each interval, shape (n - 1,)
    truck : whether a truck stood on the drum; unknown_torque : whether its torque is an estimate
    missing_current : whether the current is not logged; its relations then say nothing
    """

    time: Array
    reference: Array
    staircase: bool
    motor_speed: Array
    drum_speed: Array
    current: Array
    torque: Array
    voltage: Array | None
    noise: Array
    speed: Array
    drum_torque: Array
    truck: bool
    unknown_torque: bool
    missing_current: bool

    @property
    def intervals(self) -> Array:
        """Lengths of the intervals [s], shape (n - 1,)."""
        return np.diff(self.time)

    @property
    def rows(self) -> int:
        """Number of relations of the run."""
        return ROWS if self.voltage is not None else ARMATURE


def measured_signals(recording: Recording, p: Mapping[str, float]) -> MeasuredSignals:
    """Take the measured signals of a recording; p : parameter values [SI]."""
    log = recording.log
    missing = "armature_current" not in log
    current = np.zeros_like(log.time) if missing else log["armature_current"]
    known = dict(zip(recording.channels, recording.noise, strict=True))
    noise = np.array([known.get(name, 1.0) for name in NOISES])
    truck = "wheel_torque" in log
    wheel = log["wheel_torque"] if truck else np.zeros_like(log.time)
    signals = (log["motor_speed"], current, log["shaft_torque"])
    return MeasuredSignals(
        time=log.time,
        reference=log["speed_reference"],
        staircase=not np.any(recording.inputs.slope),
        motor_speed=log["motor_speed"],
        drum_speed=log["drum_speed"],
        current=current,
        torque=log["shaft_torque"],
        voltage=log[VOLTAGE] if VOLTAGE in recording.channels else None,
        noise=noise,
        speed=smoothed_speed(log.time, *signals, noise, p, use_current=not missing),
        drum_torque=p["drum_radius"] / p["wheel_radius"] * wheel[1:],
        truck=truck,
        unknown_torque=recording.estimated_torque,
        missing_current=missing,
    )


def smoothed_speed(
    time: Array,
    speed: Array,
    current: Array,
    torque: Array,
    noise: Array,
    p: Mapping[str, float],
    *,
    use_current: bool = True,
) -> Array:
    """Motor speed [rad/s], smoothed by the acceleration that the torques give, shape (n,).

    omega_m' = (k Phi i + T) / J_m

    A fixed-interval smoother: the tachometer and the acceleration, each with its variance, make a
    tridiagonal least squares problem. Where the two disagree for longer than noise would, the
    torques get a larger variance.
    noise : standard deviations in the order of NOISES
    """
    from scipy.linalg import solveh_banded
    from scipy.ndimage import uniform_filter1d

    k, inertia, step, width = flux(speed, p)[1:], p["motor_inertia"], np.diff(time), 21
    means = interval_means(flux(speed, p) * current) + interval_means(torque)
    variance = 0.5 * noise[3] ** 2 + 0.5 * (k * noise[2]) ** 2
    variance += jump_variance(torque, noise[3]) + k**2 * jump_variance(current, noise[2])
    if not use_current:
        variance += VOID_VARIANCE
    wrong = uniform_filter1d(inertia * np.diff(speed) / step - means, width)
    plain = noise[3] ** 2 + (k * noise[2]) ** 2
    usual = plain / width + 2.0 * (inertia * noise[0] / (width * step)) ** 2
    variance += np.where(wrong**2 > 16.0 * usual, 10.0 * wrong**2, 0.0)
    q = (step / inertia) ** 2 * variance
    diagonal, right = np.full(len(speed), noise[0] ** -2.0), speed * noise[0] ** -2.0
    diagonal[1:] += 1.0 / q
    diagonal[:-1] += 1.0 / q
    right[1:] += means / inertia * step / q
    right[:-1] -= means / inertia * step / q
    banded = np.stack([np.concatenate([[0.0], -1.0 / q]), diagonal])
    return np.asarray(solveh_banded(banded, right))


def turned_angle(time: Array, speed: Array) -> Array:
    """Angle turned since the start [rad] at the samples; speed : [rad/s]."""
    return np.asarray(np.cumsum(np.diff(time, prepend=time[0]) * speed))


def delayed_reference(m: MeasuredSignals, dead_time: float) -> Array:
    """Speed reference after the dead time [rad/s] at the samples; dead_time : [s]."""
    if not m.staircase:
        return np.interp(m.time - dead_time, m.time, m.reference)
    held = np.searchsorted(m.time, m.time - dead_time, side="right") - 1
    return np.asarray(m.reference[np.maximum(held, 0)])


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
        voltage += p["armature_inductance"] * np.gradient(m.current, m.time)
    steps = np.diff(m.time, prepend=2.0 * m.time[0] - m.time[1])
    return _compiled()(
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
def _compiled() -> Callable[..., tuple[Array, NDArray[np.bool_]]]:
    """The loop, compiled once in this process."""
    compiler.use_cache([__file__, str(compiler.__file__)], ["reconstructed reference"])
    return compiler.compile_function(_solve_backwards, on_disk=True)


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
        stacked = np.moveaxis(rows[:count], 0, 1).reshape(count * rows.shape[1], -1)
        return np.asarray(dtbtrs(self.factor, stacked, uplo="L")[0])


def relation_residuals(
    m: MeasuredSignals, p: Mapping[str, float]
) -> tuple[Array, NDArray[np.bool_]]:
    """Residuals of the relations, shape (m.rows, n - 1), and whether the drive is limited."""
    xi, step = p["gear_ratio"], m.intervals
    acceleration = np.diff(m.motor_speed) / step
    motor = p["motor_inertia"] * acceleration - interval_means(flux(m.speed, p) * m.current)
    driven = (
        p["gear_inertia"] * acceleration / xi + p["drum_inertia"] * np.diff(m.drum_speed) / step
    )
    driven += interval_means(friction(m.speed / xi, p)) - m.drum_torque
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
