"""The motion of an axis from its measured position, and the band in which the force is compared.

The inverse dynamic identification model of robots: the position passes a Butterworth low pass,
forwards and backwards so that nothing is shifted, then central differences. Force and model pass
one more low pass alike, and are decimated to the band that the model is meant for (A. Janot, P.-O.
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

# Order of the Butterworth low pass.
ORDER = 4
# Upper ends of the bands that may count [Hz].
BAND_ENDS = (2.0, 5.0, 10.0, 20.0, 40.0)
# A band is informative from this ratio of the force's power to its noise's on.
CLEAR_RATIO = 4.0
# Samples a second for each hertz of the band; the position's low pass has the same rate.
SAMPLES_PER_HERTZ = 2.5
# Left out at either end of a run, where the filters still start: at least so long [s], and at least
# so many of the samples that remain.
EDGE_TIME, EDGE_SAMPLES = 0.2, 8
# Nothing is said of an axis from a shorter run [s].
SHORTEST = 2.0
# Nothing is fitted to fewer samples of a run, or to fewer that remain in the band.
FEWEST, FEWEST_LEFT = 100, 20
# An axis rests below this share of its highest speed, for at least so long [s].
REST_SPEED, REST_TIME = 0.002, 0.1


@dataclass(frozen=True, kw_only=True)
class Motion:
    """The motion of a run at its own rate [SI], shape (n,) each.

    period : time between two samples [s]; direction : sign of the velocity
    """

    period: float
    position: Array
    velocity: Array
    acceleration: Array
    direction: Array


@dataclass(frozen=True, kw_only=True)
class Band:
    """The low pass and decimation that the measured and the modelled force pass alike.

    factor : of the decimation; edge : samples left out at either end after it
    gain : of the standard deviation of white noise
    """

    factor: int
    edge: int
    gain: float

    def __call__(self, values: Array) -> Array:
        """Filter and decimate values; give those that count."""
        return decimated(values, self.factor)[self.edge : -self.edge]


def decimated(values: Array, factor: int) -> Array:
    """Every factor-th sample of the values, low-passed without a shift."""
    from scipy.signal import decimate

    return np.asarray(decimate(values, factor, zero_phase=True)) if factor > 1 else values


def sample_period(log: AxisLog) -> float:
    """Time between two samples [s]; raises LogError where it varies, or the run is too short."""
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


def informative_frequency(log: AxisLog) -> float:
    """Upper end of the highest band in which the force is clear of its own noise [Hz].

    Above it the acceleration still contains what the motor did not do, such as ripple of the load
    and steps of the encoder. Beside a force that is all noise there, it would pass for an effect.
    """
    step = sample_period(log)
    density = power(log.force, step, tuple(zip((0.5, *BAND_ENDS[:-1]), BAND_ENDS, strict=True)))
    white = 2.0 * step * noise(log.force) ** 2
    clear = [
        top for top, found in zip(BAND_ENDS, density, strict=True) if found > CLEAR_RATIO * white
    ]
    return max(clear, default=BAND_ENDS[0])


def band_of(log: AxisLog, rate: float) -> Band:
    """Band of a log that leaves so many samples a second, or the log's own where it has fewer."""
    step = sample_period(log)
    factor = max(1, round(1.0 / step / rate))
    # Each remaining sample is a weighted sum of samples; a pulse shows the weights.
    pulse = np.zeros(401 * factor)
    pulse[200 * factor] = 1.0
    weights = np.stack([decimated(np.roll(pulse, k), factor) for k in range(factor)])
    return Band(
        factor=factor,
        edge=max(EDGE_SAMPLES, round(EDGE_TIME / step / factor)),
        gain=float(np.sqrt(np.sum(weights**2))),
    )


def motion_of(log: AxisLog, cutoff: float) -> Motion:
    """Motion of a log below a cutoff frequency [Hz].

    A log too slow for the cutoff is low-passed at a fifth of its own rate.
    """
    from scipy.signal import butter, sosfiltfilt

    step = sample_period(log)
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
    """Whether the axis rests at each sample, shape (n,); see REST_TIME and REST_SPEED."""
    slow = np.abs(m.velocity) < REST_SPEED * np.abs(m.velocity).max()
    edges = np.flatnonzero(np.diff(np.r_[False, slow, False].astype(np.int8)))
    found = np.zeros(len(slow), np.bool_)
    for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        found[first:last] = (last - first) * m.period >= REST_TIME
    return found


@dataclass(frozen=True, kw_only=True)
class AxisRun:
    """A log ready to be compared.

    time, force, moves : at the lower rate of the band, shape (n,) each
    moves : samples that count; while an axis rests, its force is whatever holds it
    noise : standard deviation of the force's noise in the band
    """

    source: str
    time: Array
    motion: Motion
    band: Band
    force: Array
    moves: NDArray[np.bool_]
    noise: float


def prepare(log: AxisLog, rate: float) -> AxisRun:
    """Prepare a log for the comparison at this sample rate [Hz].

    Raises LogError where force or position stands still, or where too few samples remain.
    """
    motion, band = motion_of(log, rate), band_of(log, rate)
    force = band(log.force)
    if len(force) < FEWEST_LEFT:
        raise LogError(
            f"{log.source}: {len(force)} samples are left of {len(log.time)} at {rate:g} a second "
            f"without the ends; {FEWEST_LEFT} or more are needed: a longer run"
        )
    level = noise(log.force) * band.gain
    for name, moving in (("position", np.ptp(log.position) > 0.0), ("force", level > 0.0)):
        if not moving:
            raise LogError(f"{log.source}: {name} does not move; a run that moves is needed")
    start = band.edge * band.factor
    kept = slice(start, start + band.factor * len(force), band.factor)
    time, moves = log.time[kept], ~resting(motion)[kept]
    return AxisRun(
        source=log.source,
        time=time,
        motion=motion,
        band=band,
        force=force,
        moves=moves,
        noise=level,
    )
