"""The drum's bearings have Coulomb friction and the friction of their lubricant's film.

    T_dw = T_c sgn omega_d + b |omega_d|^(2/3) sgn omega_d

Source: A. Palmgren, Ball and Roller Bearing Engineering (1959): the lubricant's part goes with the
speed to the power 2/3. T_c, b = 0: bearings without friction.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.kernel_types import Record

SUBSYSTEM = "drum"
PARAMETERS = {
    "coulomb": EffectParameter(
        neutral=0.0, lower=0.0, upper=500.0, plausible=20.0, unit="N m", meaning="T_c"
    ),
    "lubricant": EffectParameter(
        neutral=0.0, lower=0.0, upper=100.0, plausible=8.0, unit="N m (s/rad)^(2/3)", meaning="b"
    ),
}

# The film's slope at rest is that at this speed [rad/s].
SLOW = 0.02


def drum_coulomb_friction(value: float, s: Record, p: Record) -> float:
    """Level of the bearings' Coulomb friction [N m]."""
    return value + p.palmgren_drum_coulomb


def drum_viscous_friction(value: float, s: Record, p: Record) -> float:
    """Torque of the film over the drum speed [N m s/rad]."""
    film: float = p.palmgren_drum_lubricant * (abs(s.drum_speed) + SLOW) ** (-1.0 / 3.0)
    return value + film
