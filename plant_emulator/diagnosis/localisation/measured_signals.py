"""The measured signals of a run as the parity relations take them, with the motor speed smoothed.

A smoother joins the tachometer with the acceleration that the measured torques give. No simulation
is needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.model.array_laws import flux
from plant_emulator.signals.log import VOLTAGE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

NOISES = ("motor_speed", "drum_speed", "armature_current", "shaft_torque", VOLTAGE)
# A difference of two samples is a jump from so many deviations of the noise on.
JUMP_NOISES = 3.0 * np.sqrt(2.0)
# Below this speed the sign of the motion and the friction are open [rad/s]: four deviations of the
# smoothed motor speed.
STILL_SPEED = 0.6
# Variance that makes a relation count for nothing.
VOID_VARIANCE = 1e6


def interval_means(channel: Array) -> Array:
    """Means of a channel over the intervals, shape (n - 1, ...)."""
    return np.asarray(0.5 * (channel[1:] + channel[:-1]))


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
