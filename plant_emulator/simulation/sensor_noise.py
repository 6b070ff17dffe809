"""Adds noise and quantisation of the bench's sensors to a simulated log.

The noise is white. Standard deviations and quantisation steps are those of the independent bench's
noisy logs. These logs have no voltage: its values are assumed, 0.2 % of 500 V. The speed reference
is not measured and stays exact.
"""

from __future__ import annotations

import numpy as np

from plant_emulator.signals.log import Log

# signal -> (standard deviation, quantisation step: full scale of a 12-bit converter) [SI]
SENSORS: dict[str, tuple[float, float]] = {
    "motor_speed": (0.15, 300 / 4096),
    "drum_speed": (0.01, 20 / 4096),
    "armature_current": (0.25, 200 / 4096),
    "shaft_torque": (0.25, 100 / 4096),
    "wheel_torque": (2.0, 3000 / 4096),
    "armature_voltage": (1.0, 1000 / 4096),
}


def add_noise(log: Log, seed: int) -> Log:
    """Add noise, drawn from `seed`, and quantisation to every measured signal of a log."""
    random = np.random.default_rng(seed)
    signals = dict(log.signals)
    for name, (deviation, step) in SENSORS.items():
        if name in signals:
            value = signals[name] + deviation * random.standard_normal(len(log.time))
            signals[name] = np.round(value / step) * step
    return Log(log.time, signals, log.source, log.other)
