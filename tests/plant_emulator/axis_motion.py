"""A run of an axis in closed form: its motion is a sum of sines, its torque follows by hand."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

INERTIA, VISCOUS, COULOMB = 0.02, 0.05, 0.3
"""[kg m2, N m s/rad, N m]"""
SIZES = np.array([[2.0], [0.7], [0.2]])
"""Of the sines [rad]."""
RATES = np.array([[1.1], [3.7], [9.3]])
"""Of the sines [rad/s]."""


def motion(seed: int = 0, duration: float = 20.0, period: float = 0.01) -> tuple[Array, ...]:
    """Time, position, velocity and torque [s, rad, rad/s, N m]; torque noise of 0.01 N m."""
    noise = np.random.default_rng(seed)
    phases = noise.uniform(0.0, 2.0 * np.pi, (3, 1))
    time = np.arange(round(duration / period)) * period
    angle = RATES * time + phases
    position = (SIZES * np.sin(angle)).sum(axis=0)
    velocity = (SIZES * RATES * np.cos(angle)).sum(axis=0)
    acceleration = -(SIZES * RATES**2 * np.sin(angle)).sum(axis=0)
    torque = INERTIA * acceleration + VISCOUS * velocity + COULOMB * np.sign(velocity)
    return time, position, velocity, torque + noise.normal(0.0, 0.01, len(time))
