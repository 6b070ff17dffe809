"""What real controllers do to a log: coloured noise, hum, spikes, held, coarse and lost values.

Half of the cases have one kind of dirt, of a size that is drawn. Kind and size follow from seed and
number by a stream of their own, so that dirt changes nothing else of a case.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from plant_emulator.signals.log import COMPARED
from plant_emulator.simulation.sensor_noise import SENSORS

if TYPE_CHECKING:
    from collections.abc import Callable

    from plant_emulator.signals.log import Array, Log

DirtKind = Literal["colour", "hum", "spikes", "held", "coarse", "jitter", "lost"]
# Share of the cases with dirt.
DIRTY_SHARE = 0.5
# Range that the size of each kind is drawn from: time constant [s], amplitude [noise], share of the
# samples [1], period [samples], quantum [noise], half width [s], share of the rows [1].
RANGES: dict[DirtKind, tuple[float, float]] = {
    "colour": (0.01, 0.03),
    "hum": (1.0, 4.0),
    "spikes": (1e-3, 5e-3),
    "held": (2.0, 4.0),
    "coarse": (1.0, 3.0),
    "jitter": (5e-4, 2e-3),
    "lost": (5e-3, 3e-2),
}
# Deviation of coloured noise [noise].
COLOUR = 2.0
# Height of spikes [noise], mains [Hz] and how far off they are, longest hole [s].
SPIKE, MAINS, MAINS_OFF, DIRT_HOLE = (15.0, 40.0), 50.0, 0.05, 0.5
# Channels that hum and are held.
HUMMING, HELD_CHANNELS = ("armature_current", "shaft_torque"), ("drum_speed", "shaft_torque")


@dataclass(frozen=True, kw_only=True)
class Dirt:
    """The dirt of a case; size : in the unit of RANGES."""

    kind: DirtKind
    size: float


def draw_dirt(seed: int, number: int) -> Dirt | None:
    """Draw the dirt of a case; None: its logs are clean."""
    random = np.random.default_rng([seed, 4, number])
    kind: DirtKind = get_args(DirtKind)[int(random.integers(len(RANGES)))]
    size = float(random.uniform(*RANGES[kind]))
    return Dirt(kind=kind, size=size) if random.random() < DIRTY_SHARE else None


def soil(log: Log, dirt: Dirt, seed: int) -> Log:
    """Give a measured log with dirt; seed : of what is drawn.

    Jitter is no dirt of a measured log (KeyError): `take_rows` makes it before there is noise.
    """
    return _SOILS[dirt.kind](log, dirt.size, np.random.default_rng([seed, 5]))


def take_rows(fine: Log, time: Array, half_width: float, seed: int) -> Log:
    """Take every row of a finer log a little early or late, and stamp it as if it were not.

    time : stamps of the rows [s]; half_width : of their errors [s]; seed : of what is drawn
    """
    random = np.random.default_rng([seed, 5])
    taken = time + random.uniform(-half_width, half_width, len(time))
    signals = {name: np.interp(taken, fine.time, values) for name, values in fine.signals.items()}
    return replace(fine, time=time, signals=signals)


def whiten(rows: Array, time: Array, levels: Array, dirt: Dirt | None) -> Array:
    """The compared channels, or a change of them, over their noise; whitened for coloured noise.

    The map is linear.

    rows : [SI], shape (channels, samples), as the result [1]; time : [s], shape (samples,)
    levels : deviation of the noise without dirt [SI], shape (channels,)

    Values that are held tell nothing new. What hum, spikes and lost or jittered rows hide of a
    change is not counted.
    """
    if dirt is None:
        return rows / levels[:, None]
    sensors = np.array([SENSORS[name][0] for name in COMPARED])
    match dirt.kind:
        case "colour":
            pole = float(np.exp(-np.median(np.diff(time)) / dirt.size))
            ratios = COLOUR * sensors / levels
            white = [_whiten_colour(row, pole, q) for row, q in zip(rows, ratios, strict=True)]
            return np.stack(white) / levels[:, None]
        case "coarse":
            wider: Array = np.hypot(levels, dirt.size * sensors / np.sqrt(12.0))
            return rows / wider[:, None]
        case "held":
            again = np.arange(len(time)) % round(dirt.size) != 0
            held = np.array([name in HELD_CHANNELS for name in COMPARED])
            return np.where(held[:, None] & again, 0.0, rows / levels[:, None])
        case "hum" | "spikes" | "jitter" | "lost":
            return rows / levels[:, None]


def _whiten_colour(row: Array, pole: float, ratio: float) -> Array:
    """Whiten white noise of deviation 1 plus a first-order process, shape (samples,), as the row.

    Their sum is a process with the pole and one zero z: 1 + z^2 and z are in the proportion of its
    covariances (G. E. P. Box, G. M. Jenkins, Time Series Analysis, chapter 3).

    ratio : deviation of the first-order process
    """
    from scipy.signal import lfilter

    both = (1.0 + pole**2 + ratio**2 * (1.0 - pole**2)) / pole
    zero = 2.0 / (both + np.sqrt(both**2 - 4.0))
    innovation = float(np.sqrt(pole / zero))
    return np.asarray(lfilter([1.0, -pole], [1.0, -zero], row), float) / innovation


def _replace_signals(log: Log, changes: dict[str, Array]) -> Log:
    return replace(log, signals={**log.signals, **changes})


def _colour(log: Log, time_constant: float, random: np.random.Generator) -> Log:
    """Add noise that is correlated over a time constant, larger than the sensor's own."""
    from scipy.signal import lfilter

    pole = float(np.exp(-np.median(np.diff(log.time)) / time_constant))
    found = {}
    for name in COMPARED:
        draws = random.standard_normal(len(log.time))
        slow = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], draws)
        found[name] = log[name] + COLOUR * SENSORS[name][0] * slow
    return _replace_signals(log, found)


def _hum(log: Log, amplitude: float, random: np.random.Generator) -> Log:
    """Add the mains and half as much of their double."""
    mains = MAINS + random.uniform(-MAINS_OFF, MAINS_OFF)
    found = {}
    for name in HUMMING:
        first, second = random.uniform(-np.pi, np.pi, 2)
        turns = 2.0 * np.pi * mains * log.time
        wave = np.cos(turns + first) + 0.5 * np.cos(2.0 * turns + second)
        found[name] = log[name] + amplitude * SENSORS[name][0] * wave
    return _replace_signals(log, found)


def _spikes(log: Log, share: float, random: np.random.Generator) -> Log:
    """Add single values far off to this share of the samples of each channel."""
    found = {}
    for name in COMPARED:
        there = random.random(len(log.time)) < share
        height = random.uniform(*SPIKE, len(log.time)) * random.choice([-1.0, 1.0], len(log.time))
        found[name] = log[name] + np.where(there, height, 0.0) * SENSORS[name][0]
    return _replace_signals(log, found)


def _hold_channels(log: Log, period: float, _: np.random.Generator) -> Log:
    """Renew some channels every few samples only."""
    fresh = np.arange(len(log.time)) // round(period) * round(period)
    return _replace_signals(log, {name: log[name][fresh] for name in HELD_CHANNELS})


def _coarse(log: Log, quantum: float, _: np.random.Generator) -> Log:
    """Round all channels to a multiple of the noise."""
    steps = {name: quantum * SENSORS[name][0] for name in COMPARED}
    return _replace_signals(log, {name: np.round(log[name] / q) * q for name, q in steps.items()})


def _lose_rows(log: Log, share: float, random: np.random.Generator) -> Log:
    """Leave out this share of the rows, and a hole."""
    kept = random.random(len(log.time)) >= share
    start = random.uniform(0.2, 0.8) * log.time[-1]
    kept &= (log.time < start) | (log.time > start + random.uniform(0.1, DIRT_HOLE))
    kept[:10] = kept[-1] = True
    signals = {name: values[kept] for name, values in log.signals.items()}
    return replace(log, time=log.time[kept], signals=signals)


_SOILS: dict[DirtKind, Callable[[Log, float, np.random.Generator], Log]] = {
    "colour": _colour,
    "hum": _hum,
    "spikes": _spikes,
    "held": _hold_channels,
    "coarse": _coarse,
    "lost": _lose_rows,
}
