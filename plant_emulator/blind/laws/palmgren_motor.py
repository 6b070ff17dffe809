"""The motor loses torque in its bearings' lubricant, in its brushes and in its fan.

    T_mw = T_c sgn omega_m + b |omega_m|^(2/3) sgn omega_m + k |omega_m|^1.8 sgn omega_m

Sources: A. Palmgren, Ball and Roller Bearing Engineering (1959): the lubricant's torque grows with
the power 2/3 of the speed; H. Schlichting, Boundary-Layer Theory: turbulent drag on a rotating disc
grows with the power 1.8. The brushes have Coulomb friction. T_c, b, k = 0: no losses.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "motor"
PARAMETERS = {
    "coulomb": EffectParameter(
        neutral=0.0, lower=0.0, upper=10.0, plausible=0.4, unit="N m", meaning="T_c"
    ),
    "lubricant": EffectParameter(
        neutral=0.0, lower=0.0, upper=1.0, plausible=0.003, unit="N m (s/rad)^(2/3)", meaning="b"
    ),
    "drag": EffectParameter(
        neutral=0.0, lower=0.0, upper=1e-3, plausible=1.2e-5, unit="N m (s/rad)^1.8", meaning="k"
    ),
}

# Speed that bounds the slope of the film's torque at rest [rad/s].
SLOW = 1.0


def motor_coulomb_friction(value: float, s: Record, p: Record) -> float:
    """Coulomb friction of the motor [N m]."""
    return value + p.palmgren_motor_coulomb


def motor_viscous_friction(value: float, s: Record, p: Record) -> float:
    """Torque of lubricant and fan divided by the motor speed [N m s/rad]."""
    speed = abs(s.motor_speed)
    film: float = p.palmgren_motor_lubricant * (speed + SLOW) ** (-1.0 / 3.0)
    drag: float = p.palmgren_motor_drag * speed**0.8
    return value + film + drag
