"""Velocity and acceleration of an axis from its measured position, and the band that counts (pure).

The inverse dynamic identification model of robots: position through a Butterworth low pass that
runs forwards and backwards and so shifts nothing, then central differences; force and model through
one more low pass alike, and thinned out to the band that the model is meant for (A. Janot, P.-O.
Vandanjon, M. Gautier, IEEE Trans. Control Systems Technology 22 (2014) 132).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.signals.frequency_bands import power
from plant_emulator.signals.noise import noise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from plant_emulator.signals.axis_log import AxisLog
    from plant_emulator.signals.log import Array

ORDER = 4
TOPS = (2.0, 5.0, 10.0, 20.0, 40.0)
"""Upper ends of the bands that may count [Hz]."""
CLEAR = 4.0
"""Power of the force over that of its noise from which a band tells something of the axis."""
SAMPLES = 2.5
"""Samples a second for each hertz of the band; the low pass on the position is at that rate too."""
EDGE, EDGE_SAMPLES = 0.2, 8
"""Left out at either end of a run, in which the filters still start: [s], samples that remain."""
SHORTEST = 2.0
"""[s] of a run below which nothing is said of an axis."""
FEWEST, FEWEST_LEFT = 100, 20
"""Samples of a run, and those that remain of it in the band, below which nothing is fitted."""
REST, REST_SPEED = 0.1, 0.002
"""[s] from which an axis rests, and the share of its highest speed below which it does."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """The motion of a run at its own rate, shape (n,) each.

    period : between samples [s]
    """

    period: float
    position: Array
    velocity: Array
    acceleration: Array
    direction: Array


@dataclass(frozen=True, kw_only=True)
class Band:
    """The low pass and thinning that measured and modelled force go through alike.

    gain : of the standard deviation of white noise in it
    """

    factor: int
    edge: int
    gain: float

    def __call__(self, values: Array) -> Array:
        """Values that count, at the lower rate."""
        return thinned(values, self.factor)[self.edge : -self.edge]


def thinned(values: Array, factor: int) -> Array:
    """Every so-manieth sample of the values, low-passed without a shift."""
    from scipy.signal import decimate

    return np.asarray(decimate(values, factor, zero_phase=True)) if factor > 1 else values


def period(log: AxisLog) -> float:
    """Time between two samples [s]; LogError where they are not even, or the run is too short."""
    if len(log.time) < FEWEST:
        raise LogError(f"{log.source}: {len(log.time)} samples; {FEWEST} or more are needed")
    steps = np.diff(log.time)
    usual = float(np.median(steps))
    worst = int(np.argmax(np.abs(steps - usual)))
    if abs(steps[worst] - usual) > 0.5 * usual:
        raise LogError(
            f"{log.source}: {steps[worst]:.4g} s between samples at {log.time[worst]:.4g} s, "
            f"{usual:.4g} s elsewhere; an axis needs even samples without gaps"
        )
    length = float(log.time[-1] - log.time[0])
    if length < SHORTEST:
        raise LogError(f"{log.source}: {length:.3g} s; a run of {SHORTEST:g} s or more is needed")
    return length / len(steps)


def told(log: AxisLog) -> float:
    """Upper end of the highest band [Hz] in which the force is clear of its own noise.

    Above it the acceleration still holds what the motor did not do (ripple of the load, steps of
    the encoder), and against a force that is all noise there it would pass for an effect.
    """
    step = period(log)
    density = power(log.force, step, tuple(zip((0.5, *TOPS[:-1]), TOPS, strict=True)))
    white = 2.0 * step * noise(log.force) ** 2
    clear = [top for top, found in zip(TOPS, density, strict=True) if found > CLEAR * white]
    return max(clear, default=TOPS[0])


def band(log: AxisLog, rate: float) -> Band:
    """The band of a log that leaves so many samples a second, or its own where that is less."""
    step = period(log)
    factor = max(1, round(1.0 / step / rate))
    # Each sample that remains is a sum of samples, weighted by what a single one becomes.
    pulse = np.zeros(401 * factor)
    pulse[200 * factor] = 1.0
    weights = np.stack([thinned(np.roll(pulse, k), factor) for k in range(factor)])
    return Band(
        factor=factor,
        edge=max(EDGE_SAMPLES, round(EDGE / step / factor)),
        gain=float(np.sqrt(np.sum(weights**2))),
    )


def motion(log: AxisLog, cutoff: float) -> Motion:
    """Position, velocity and acceleration of a log below `cutoff` [Hz].

    A log too slow for that is low-passed at a fifth of its own rate.
    """
    from scipy.signal import butter, sosfiltfilt

    step = period(log)
    sections = butter(ORDER, min(cutoff, 0.2 / step), fs=1.0 / step, output="sos")
    position = np.asarray(sosfiltfilt(sections, log.position))
    velocity = np.gradient(position, step)
    return Motion(
        period=step,
        position=position,
        velocity=velocity,
        acceleration=np.gradient(velocity, step),
        direction=np.sign(velocity),
    )


def resting(m: Motion) -> NDArray[np.bool_]:
    """Samples of a motion, shape (n,), in stretches of REST and more at hardly any speed."""
    slow = np.abs(m.velocity) < REST_SPEED * np.abs(m.velocity).max()
    edges = np.flatnonzero(np.diff(np.r_[False, slow, False].astype(np.int8)))
    found = np.zeros(len(slow), np.bool_)
    for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        found[first:last] = (last - first) * m.period >= REST
    return found


@dataclass(frozen=True, kw_only=True)
class AxisRun:
    """A log ready to be compared: its motion, the force in the band, and the force's noise.

    moves : samples that count: while an axis rests its force is whatever holds it
    """

    source: str
    time: Array
    motion: Motion
    band: Band
    force: Array
    moves: NDArray[np.bool_]
    noise: float


def prepared(log: AxisLog, rate: float) -> AxisRun:
    """A log with its motion; LogError where force or position stands still, or little is left."""
    moved, thin = motion(log, rate), band(log, rate)
    force = thin(log.force)
    if len(force) < FEWEST_LEFT:
        raise LogError(
            f"{log.source}: {len(force)} samples are left of {len(log.time)} at {rate:g} a second "
            f"without the ends; {FEWEST_LEFT} or more are needed: a longer run"
        )
    level = noise(log.force) * thin.gain
    for name, moving in (("position", np.ptp(log.position) > 0.0), ("force", level > 0.0)):
        if not moving:
            raise LogError(f"{log.source}: {name} does not move; a run that moves is needed")
    start = thin.edge * thin.factor
    kept = slice(start, start + thin.factor * len(force), thin.factor)
    time, moves = log.time[kept], ~resting(moved)[kept]
    return AxisRun(
        source=log.source, time=time, motion=moved, band=thin, force=force, moves=moves, noise=level
    )
