"""What measured signals alone must satisfy, block by block, and the noise of it from the sensors'.

Over every interval between two samples, with means of what acts in it (thesis, eq. 3.10, 3.20,
3.34 with the drum's torque eliminated, and 3.1-3.8 solved for the reference):

    motor     J_m omega_m' - k Phi(omega_m) i - T = 0
    gear      T + (J_g omega_m'/xi + J_d omega_d' + T_f(omega_m/xi) - T_d) / xi = 0
    drive     omega_m + e - omega_ref(t - b) = 0,   e : speed error that the current tells of
    armature  u - R_a i - L_a i' - k Phi(omega_m) omega_m = 0,   where the voltage is logged

No relation needs a simulation, or to know whether gear and drum touch: momentum is kept in the gap
too. The drive's works backwards through both controllers: u, logged or from the armature's, gives
i_ref = i + u/K_c - (its part that the integrator holds), i_ref gives e the same way. At a limit it
tells nothing.

Noise is propagated: the relations are linear in the noise of omega_m, omega_d, i, T and u at two
samples, so their covariance over the run is banded and its Cholesky factor whitens them. A jump
within an interval adds what the mean of its ends leaves open, jump^2/12. At standstill friction
takes any value up to its level.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.log import VOLTAGE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

MOTOR, GEAR, DRIVE, ARMATURE = range(4)
# Of a run with its voltage; without it the armature's, the last one, is not there.
ROWS = 4
NOISES = ("motor_speed", "drum_speed", "armature_current", "shaft_torque", VOLTAGE)
# A difference of two samples that is no noise: three deviations of it.
JUMP = 3.0 * np.sqrt(2.0)
# Four deviations of the smoothed motor speed [rad/s]: below, its sign and the friction are open.
STILL = 0.6
# Share of a limit from which on the drive counts as limited.
AT_LIMIT = 0.97
# Variance that makes a relation count for nothing.
VOID = 1e6


def middle(channel: Array) -> Array:
    """Means over the intervals, shape (n - 1, ...)."""
    return np.asarray(0.5 * (channel[1:] + channel[:-1]))


def flux(speed: Array, p: Mapping[str, float]) -> Array:
    """Flux k Phi [N m/A] (thesis, eq. 3.16-3.18)."""
    weakened = p["flux_constant_1"] / (p["flux_constant_2"] + np.abs(speed))
    return np.asarray(np.minimum(p["flux_constant"], weakened))


def base_speed(p: Mapping[str, float]) -> float:
    """Speed above which the field is weakened [rad/s] (thesis, eq. 3.18)."""
    return p["flux_constant_1"] / p["flux_constant"] - p["flux_constant_2"]


def friction(speed: Array, p: Mapping[str, float]) -> Array:
    """Friction of the gear [N m] at its output's speed [rad/s] (thesis, eq. 3.27)."""
    rest = p["gear_viscous_friction"] * np.abs(speed) ** p["gear_friction_exponent"]
    return np.asarray((p["gear_coulomb_friction"] + rest) * np.sign(speed))


def jump(channel: Array, deviation: float) -> Array:
    """Variance of the mean of two samples as a mean over the interval, where it jumps."""
    step = np.diff(channel)
    return np.where(np.abs(step) > JUMP * deviation, step**2 / 12.0, 0.0)


@dataclass(frozen=True)
class Measured:
    """The signals of a run [SI], shape (n,) each; noise : standard deviations in NOISES' order.

    speed : the motor's, smoothed; drum_torque : of the truck over each interval, shape (n - 1,)
    voltage : of the armature; None: not logged
    missing_current : relations with the current then tell nothing
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
    missing_current: bool

    @property
    def intervals(self) -> Array:
        """Lengths of the intervals [s], shape (n - 1,)."""
        return np.diff(self.time)

    @property
    def rows(self) -> int:
        """How many relations the run has."""
        return ROWS if self.voltage is not None else ARMATURE


def measured(recording: Recording, p: Mapping[str, float]) -> Measured:
    """The signals of a recording."""
    log = recording.log
    missing = "armature_current" not in log
    current = np.zeros_like(log.time) if missing else log["armature_current"]
    known = dict(zip(recording.channels, recording.noise, strict=True))
    noise = np.array([known.get(name, 1.0) for name in NOISES])
    truck = "wheel_torque" in log
    wheel = log["wheel_torque"] if truck else np.zeros_like(log.time)
    signals = (log["motor_speed"], current, log["shaft_torque"])
    return Measured(
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
    """Motor speed [rad/s], smoothed by what the torques tell of its acceleration.

    The tachometer and omega_m' = (k Phi i + T)/J_m, each with its variance: a tridiagonal least
    squares problem (a fixed-interval smoother). Where the two disagree for longer than noise would,
    the torques are believed the less.
    """
    from scipy.linalg import solveh_banded
    from scipy.ndimage import uniform_filter1d

    k, inertia, step, width = flux(speed, p)[1:], p["motor_inertia"], np.diff(time), 21
    means = middle(flux(speed, p) * current) + middle(torque)
    variance = 0.5 * noise[3] ** 2 + 0.5 * (k * noise[2]) ** 2
    variance += jump(torque, noise[3]) + k**2 * jump(current, noise[2])
    if not use_current:
        variance += VOID
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


def turned(time: Array, speed: Array) -> Array:
    """Angle that something has turned since the start [rad], at the samples."""
    return np.asarray(np.cumsum(np.diff(time, prepend=time[0]) * speed))


def delayed_reference(m: Measured, dead_time: float) -> Array:
    """Reference after the dead time [rad/s], at the samples."""
    if not m.staircase:
        return np.interp(m.time - dead_time, m.time, m.reference)
    held = np.searchsorted(m.time, m.time - dead_time, side="right") - 1
    return np.asarray(m.reference[np.maximum(held, 0)])


def reconstructed_reference(
    m: Measured, p: Mapping[str, float], nominal: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Reference that the drive must have had [rad/s], and where it was limited and tells nothing.

    nominal : the delayed reference, for the integrators while the drive is limited
    """
    voltage = m.voltage
    if voltage is None:
        voltage = p["armature_resistance"] * m.current + flux(m.speed, p) * m.motor_speed
        voltage += p["armature_inductance"] * np.gradient(m.current, m.time)
    steps = np.diff(m.time, prepend=2.0 * m.time[0] - m.time[1])
    reconstructed = np.empty_like(m.time)
    limited = np.zeros(len(reconstructed), bool)
    held_voltage = held_current = 0.0
    for n, (u, i, h) in enumerate(zip(voltage, m.current, steps, strict=True)):
        short = (u - held_voltage) / (1.0 + h / p["current_integral_time"]) / p["current_gain"]
        wanted = i + short
        over = abs(wanted) > AT_LIMIT * p["armature_current_limit"]
        limited[n] = over or abs(u) > AT_LIMIT * p["voltage_limit"]
        error = (wanted - held_current) / (1.0 + h / p["speed_integral_time"]) / p["speed_gain"]
        if limited[n]:
            error = nominal[n] - m.motor_speed[n]
        else:
            held_voltage += h / p["current_integral_time"] * p["current_gain"] * short
        if not over:
            held_current += h / p["speed_integral_time"] * p["speed_gain"] * error
        reconstructed[n] = m.motor_speed[n] + error
    return reconstructed, limited


@dataclass(frozen=True)
class Relations:
    """The relations of a run, shape (3 or 4, n - 1) [N m, N m, rad/s, V], and what whitens them."""

    value: Array
    factor: Array

    def white(self, rows: Array) -> Array:
        """Rows of shape (r, n - 1, k), whitened, shape (r (n - 1), k); rows beyond are left out."""
        from scipy.linalg import solve_banded

        count = len(self.value)
        stacked = np.moveaxis(rows[:count], 0, 1).reshape(count * rows.shape[1], -1)
        below = len(self.factor) - 1
        return np.asarray(solve_banded((below, 0), self.factor, stacked))


def values(m: Measured, p: Mapping[str, float]) -> tuple[Array, NDArray[np.bool_]]:
    """What is left of the relations, shape (m.rows, n - 1), and where the drive is limited."""
    xi, step = p["gear_ratio"], m.intervals
    acceleration = np.diff(m.motor_speed) / step
    motor = p["motor_inertia"] * acceleration - middle(flux(m.speed, p) * m.current)
    driven = (
        p["gear_inertia"] * acceleration / xi + p["drum_inertia"] * np.diff(m.drum_speed) / step
    )
    driven += middle(friction(m.speed / xi, p)) - m.drum_torque
    nominal = delayed_reference(m, p["dead_time"])
    reconstructed, limited = reconstructed_reference(m, p, nominal)
    rows = [
        motor - middle(m.torque),
        middle(m.torque) + driven / xi,
        middle(reconstructed - nominal),
    ]
    if m.voltage is not None:
        induced = p["armature_inductance"] * np.diff(m.current) / step
        emf = flux(m.speed, p) * m.motor_speed
        rows.append(middle(m.voltage - p["armature_resistance"] * m.current - emf) - induced)
    return np.stack(rows), limited[1:] | limited[:-1]
