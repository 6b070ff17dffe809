"""Whether several logs are of one bench: what no run, load or temperature can change (pure).

While the gear drives or brakes the drum, a flank of the backlash is in contact and both turn as
one. With theta the angle that the motor has turned, through the gear, and delta the one by which
the drum lags behind it,

    delta = delta_0 + s theta + tau omega_d + k/2 omega_d |omega_d| + J_d omega_d' / k_gd + f alpha

f = 1 on the driving flank, -1 on the braking one (thesis, eq. 3.27 and 3.34). s is the share by
which the drum shows less than the gear ratio says: the scale of either speed sensor, or the ratio
itself. Lag tau and slip k of the measuring wheel and the gap's half width alpha are fitted beside
it. Torque, current and friction are not in it, hence nothing that oil or windings change. The noise
of delta is that of the speeds, summed up: a random walk, white between neighbouring samples. A
truck on the drum hides which flank is in contact; such a run says nothing here.

Two logs whose s differs by more than their errors and what this picture is good for are not of one
bench, or it was changed between them; a diagnosis of both together would have no answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.signals.noise import noise
from plant_emulator.signals.smoothing import smooth

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from plant_emulator.signals.log import Array, Log

# Smoothing before the derivative, and contact before and after a sample that counts [s].
WINDOW, SETTLED = 0.2, 0.2
# Acceleration of the drum from which the gear drives it, and from which it brakes it [rad/s^2]: the
# one above its noise, the other above what bearings do to a drum that floats in the gap.
DRIVEN, BRAKED = 0.25, 0.75
# Gear and drum in contact differ by less [rad/s], and by less of their speed.
TOGETHER, SHARE = 0.03, 0.02
# One sample in this time [s]; fewer samples say nothing.
APART, LEAST_SAMPLES = 0.05, 20
# Of delta, beside the noise of the speeds: what smoothing leaves [rad].
ROUGH = 3e-4
# What is believed of s, tau [s], k [s^2/rad] and alpha [rad] before: standard deviations, wide.
BELIEVED = np.array([0.05, 0.05, 0.01, 0.3])
# What this picture of the contact is good for, a standard deviation of s.
PICTURE = 1e-3
# Standard errors from which on two logs are not of one bench.
DIFFERENT = 6.0


@dataclass(frozen=True, kw_only=True)
class Scale:
    """The share s of a log with its standard error."""

    source: str
    share: float
    error: float


def check_same_bench(logs: Sequence[Log], values: Mapping[str, float]) -> None:
    """Raise LogError if two logs cannot be of one bench; values : all parameters [SI]."""
    found = [scale for log in logs if (scale := scale_of(log, values)) is not None]
    for first, second in combinations(found, 2):
        error = float(np.sqrt(first.error**2 + second.error**2 + PICTURE**2))
        apart = abs(first.share - second.share) / error
        if apart > DIFFERENT:
            raise LogError(
                f"{second.source}: drum speed over motor speed is {_percent(second)} what the gear "
                f"ratio says while the gear drives, and {_percent(first)} in {first.source}: "
                f"{apart:.0f} standard errors apart; give logs of one bench, unchanged between them"
            )


def _percent(scale: Scale) -> str:
    return f"{100.0 * (1.0 - scale.share):.2f} %"


def scale_of(log: Log, values: Mapping[str, float]) -> Scale | None:
    """Share by which the drum shows less than the gear ratio says; None: no information on it."""
    if "wheel_torque" in log:
        return None
    gear_speed, drum_speed = log["motor_speed"] / values["gear_ratio"], log["drum_speed"]
    period = float(np.median(np.diff(log.time)))
    speed, driven = (smooth(log.time, drum_speed, WINDOW, order) for order in (0, 1))
    faster = driven * np.sign(speed)
    flank = np.sign(driven) * ((faster > DRIVEN) | (faster < -BRAKED))
    apart = np.abs(smooth(log.time, gear_speed - drum_speed, WINDOW))
    counts = _steady(flank, SETTLED / period) & (apart < TOGETHER + SHARE * np.abs(speed))
    index = np.flatnonzero(counts)[:: max(1, round(APART / period))]
    if len(index) < LEAST_SAMPLES:
        return None
    delta = _sum(gear_speed - drum_speed, log.time)
    delta = delta - values["drum_inertia"] * driven / values["drum_shaft_stiffness"]
    theta = _sum(gear_speed, log.time)
    columns = np.stack([theta, speed, 0.5 * speed * np.abs(speed), flank], axis=1)
    walk = period * float(np.hypot(noise(drum_speed), noise(gear_speed)))
    sigma = np.sqrt(walk**2 * np.diff(index) + ROUGH**2)
    share, error = _first(
        np.diff(columns[index], axis=0) / sigma[:, None], np.diff(delta[index]) / sigma
    )
    return Scale(source=log.source, share=share, error=error)


def _sum(values: Array, time: Array) -> Array:
    """Integral by the trapezoidal rule, 0 at the first sample."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])


def _steady(flank: Array, reach: float) -> NDArray[np.bool_]:
    """Samples with the same flank in contact that many samples before and after."""
    edges = np.flatnonzero(np.diff(flank)) + 1
    found = np.zeros(len(flank), bool)
    margin = round(reach)
    for first, last in zip([0, *edges], [*edges, len(flank)], strict=True):
        found[first + margin : max(first + margin, last - margin)] = flank[first] != 0.0
    return found


def _first(rows: Array, wanted: Array) -> tuple[float, float]:
    """First coefficient with what is believed, and its standard error by what is left."""
    normal = rows.T @ rows + np.diag(BELIEVED**-2.0)
    found = np.linalg.solve(normal, rows.T @ wanted)
    left = float(np.mean((wanted - rows @ found) ** 2))
    return float(found[0]), float(np.sqrt(np.linalg.inv(normal)[0, 0] * max(1.0, left)))
