"""The flux of the motor, as the gateway knows it (thesis, eq. 3.16-3.18)."""

import numpy as np

from gateway.arrays import Array
from gateway.configuration.config import BenchConfig


def flux(bench: BenchConfig, motor_speed: Array | float) -> Array:
    """Flux k Phi = min(K_m, K_1 / (K_2 + |omega_m|)) [N m/A] at speeds of the motor [rad/s]."""
    weakened = bench.flux_constant_1 / (bench.flux_constant_2 + np.abs(motor_speed))
    return np.minimum(bench.flux_constant, weakened)
