"""Noise and resolution of the bench's sensors, for logs that should look measured.

White noise of the standard deviations and steps of quantisation that the independent bench's noisy
logs have; those have no voltage, whose figures are assumed: 0.2 % of 500 V. The reference is not
measured and stays exact.
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
    """The log as the sensors would show it, noise drawn from `seed`."""
    random = np.random.default_rng(seed)
    signals = dict(log.signals)
    for name, (deviation, step) in SENSORS.items():
        if name in signals:
            value = signals[name] + deviation * random.standard_normal(len(log.time))
            signals[name] = np.round(value / step) * step
    return Log(log.time, signals, log.source, log.other)
