"""Adds noise and quantisation of the bench's sensors to a simulated log.

The noise is white. Standard deviations and quantisation steps are those of the independent bench's
noisy logs. These logs have no voltage: its values are assumed, 0.2 % of 500 V. The speed reference
is not measured and stays exact.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.log import Log
from plant_emulator.simulation.sensing import sensing_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.model.sensors import Sensor

# signal -> (standard deviation, quantisation step: full scale of a 12-bit converter) [SI]
SENSORS: dict[str, tuple[float, float]] = {
    "motor_speed": (0.15, 300 / 4096),
    "drum_speed": (0.01, 20 / 4096),
    "armature_current": (0.25, 200 / 4096),
    "shaft_torque": (0.25, 100 / 4096),
    "wheel_torque": (2.0, 3000 / 4096),
    "armature_voltage": (1.0, 1000 / 4096),
}


def noise_of(name: str, sensors: Mapping[str, Sensor]) -> float:
    """Standard deviation of a channel's noise [its unit]: the declared one, else the bench's."""
    declared = sensors[name].noise if name in sensors else None
    return SENSORS[name][0] if declared is None else declared


def add_noise(log: Log, seed: int, sensors: Mapping[str, Sensor] | None = None) -> Log:
    """Add noise, drawn from `seed`, and quantisation to every measured signal of a log.

    sensors : declared sensors by channel; a declared noise takes the place of the bench's, and a
        value that is held keeps its noise
    """
    declared = sensors or {}
    sensing = sensing_of(log, declared)
    random = np.random.default_rng(seed)
    signals = dict(log.signals)
    for name, (_, step) in SENSORS.items():
        if name in signals:
            draws = random.standard_normal(len(log.time))
            if sensing is not None:
                draws = draws[np.cumsum(sensing.has_new_reading(name)) - 1]
            value = signals[name] + noise_of(name, declared) * draws
            signals[name] = np.round(value / step) * step
    return Log(log.time, signals, log.source, log.other)
