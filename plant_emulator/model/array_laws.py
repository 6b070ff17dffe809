"""The flux of the motor and the friction of the gear as arrays over the samples of a run.

The laws of `laws.py` take the record of one implicit stage. Relations between measured signals need
the nominal laws at all samples at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def flux(motor_speed: Array, p: Mapping[str, float]) -> Array:
    """Flux k Phi [N m/A] at motor speeds [rad/s] (thesis, eq. 3.16 to 3.18)."""
    weakened = p["flux_constant_1"] / (p["flux_constant_2"] + np.abs(motor_speed))
    return np.asarray(np.minimum(p["flux_constant"], weakened))


def base_speed(p: Mapping[str, float]) -> float:
    """Motor speed above which the field is weakened [rad/s] (thesis, eq. 3.18)."""
    return p["flux_constant_1"] / p["flux_constant"] - p["flux_constant_2"]


def sliding_friction(gear_speed: Array, p: Mapping[str, float]) -> Array:
    """Size of the friction of the turning gear [N m] at speeds of its output [rad/s].

    f_gc + f_g |omega_g|^delta_g                                          (thesis, eq. 3.27)
    """
    viscous = p["gear_viscous_friction"] * np.abs(gear_speed) ** p["gear_friction_exponent"]
    return np.asarray(p["gear_coulomb_friction"] + viscous)


def gear_friction(gear_speed: Array, p: Mapping[str, float]) -> Array:
    """Friction torque of the gear [N m] at speeds of its output [rad/s]; 0 at rest."""
    return np.asarray(sliding_friction(gear_speed, p) * np.sign(gear_speed))
