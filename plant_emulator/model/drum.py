"""The drum and its backlash shaft: their torque T_gd on the gear at a given gear speed omega_g.

The equations of drum and shaft (thesis, eq. 3.29-3.31, 3.34) are eliminated for one implicit stage
of size a. T_gd is then a piecewise linear function of omega_g. Coulomb friction is not smoothed: a
body sticks while all other torques on it stay within its friction level.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.model.stage import BACKLASH, DRUM_SPEED, GEAR_SPEED

if TYPE_CHECKING:
    from plant_emulator.model.records import Record, State


def torque_beyond_friction(torque: float, level: float) -> float:
    """Torque beyond Coulomb friction of that level [N m]; 0 while the body sticks."""
    if torque > level:
        return torque - level
    if torque < -level:
        return torque + level
    return 0.0


def prepare_drum(base: State, a: float, s: Record, p: Record) -> None:
    """Write the coefficients of T_gd as a function of omega_g (thesis, eq. 3.29-3.31, 3.34).

    D_alpha acts on y = d + (c/k_gd) d' = contact_offset + contact_slope (omega_g - omega_d).

    base : states that the stage starts from; a : implicit step [s]
    """
    inertia = p.drum_inertia / a
    s.drum_compliance = 1.0 / (inertia + s.drum_viscous_friction)
    s.drum_offset = inertia * base[DRUM_SPEED] + s.drum_torque
    s.contact_offset = base[BACKLASH]
    s.contact_slope = a + p.drum_shaft_damping / p.drum_shaft_stiffness
    k_gd = p.drum_shaft_stiffness
    s.contact_stiffness = k_gd / (1.0 + k_gd * s.contact_slope * s.drum_compliance)
    s.gear_inertia_over_step = p.gear_inertia / a
    s.gear_offset = s.gear_inertia_over_step * base[GEAR_SPEED] - s.gear_torque


def dead_zone(y: float, half_gap: float) -> float:
    """Dead zone D_alpha(y) [rad] (thesis, eq. 3.31); y, half_gap [rad]."""
    if y > half_gap:
        return y - half_gap
    if y < -half_gap:
        return y + half_gap
    return 0.0


def drum_shaft_torque(gear_speed: float, s: Record, p: Record) -> tuple[float, float]:
    """T_gd and its slope with omega_g [N m, N m s/rad]; omega_d is written to s.drum_speed.

    The drum sticks while shaft torque and truck torque together stay within its Coulomb friction.
    The brake of the truck is part of that friction. Otherwise the drum's equation, which is linear
    in T_gd, is eliminated.

    gear_speed : omega_g at the end of the stage [rad/s]
    """
    slope, offset, level = s.contact_slope, s.drum_offset, s.drum_coulomb_friction
    y = s.contact_offset + slope * gear_speed
    if level > 0.0:
        k_gd = p.drum_shaft_stiffness
        torque = k_gd * dead_zone(y, s.backlash_half_gap)
        left = torque_beyond_friction(offset + torque, level)
        if left == 0.0:
            s.drum_speed = 0.0
            return torque, k_gd * slope if torque != 0.0 else 0.0
        offset -= level if left > 0.0 else -level
    free = offset * s.drum_compliance
    torque = s.contact_stiffness * dead_zone(y - slope * free, s.backlash_half_gap)
    s.drum_speed = free + torque * s.drum_compliance
    return torque, s.contact_stiffness * slope if torque != 0.0 else 0.0
