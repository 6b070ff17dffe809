"""The drum's bearings have Coulomb and viscous friction.

    T_dw = T_c sgn omega_d + b omega_d (|omega_d| / 1 rad/s)^(n - 1)

Sources: SKF, Rolling Bearings catalogue, chapter on bearing friction: the torque by load and seals
hardly depends on the speed; the torque of the lubricant rises with it. A thick lubricant gives
n = 1, a thin film n = 2/3 (A. Palmgren, Ball and Roller Bearing Engineering, 1959).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drum"
PARAMETERS = {
    "coulomb": EffectParameter(
        neutral=0.0, lower=0.0, upper=500.0, plausible=20.0, unit="N m", meaning="T_c"
    ),
    "viscous": EffectParameter(
        neutral=0.0, lower=0.0, upper=100.0, plausible=5.0, unit="N m s/rad", meaning="b"
    ),
    "exponent": EffectParameter(
        neutral=1.0, lower=0.3, upper=1.5, plausible=1.0, unit="1", meaning="n", std=0.25
    ),
}

# Below this speed the lubricant's torque is proportional to it, with a finite slope [rad/s].
SLOW = 0.02


def drum_coulomb_friction(value: float, s: Record, p: Record) -> float:
    """Coulomb friction of the bearings [N m]."""
    return value + p.drum_bearing_friction_coulomb


def drum_viscous_friction(value: float, s: Record, p: Record) -> float:
    """Torque of the lubricant divided by the drum speed [N m s/rad]."""
    if p.drum_bearing_friction_viscous == 0.0:
        return value
    speed = abs(s.drum_speed) + SLOW
    film: float = speed ** (p.drum_bearing_friction_exponent - 1.0)
    return value + p.drum_bearing_friction_viscous * film
