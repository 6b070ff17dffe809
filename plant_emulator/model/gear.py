"""The gear: its speed at the end of an implicit stage, from one scalar equation.

    J_g/a omega_g - momentum - xi T_mg(omega_g) + T_gd(omega_g) + T_f = 0

Motor, shafts and drum are linear or piecewise linear in omega_g (`plant.prepare_motor`, `contact`).
T_f is set-valued at rest: stick is a test. While the gear turns

    T_f = d [k(d) (T_c + f_g |omega_g|^delta_g) + T_s(omega_g) + T_l(T_mg, T_gd)]

d : direction, `s.gear_direction`: the sign of omega_g; at rest that of what drives the gear, 0
    where nothing does. k, T_s, T_l : laws that the thesis has not (1, 0, 0); each is evaluated at
    the direction, the speed and the torques of the very solution, so that an effect may use them
    freely, where a law that looks at an estimate would go to and fro between two directions.

T_s may fall with the speed (Stribeck): Newton's slope leaves it and T_l out, as both are small
against the inertia of the motor over the stage, xi^2 J_m / a, and the root stays bracketed.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

from plant_emulator.model.drum import drum_side, slipping
from plant_emulator.model.laws import (
    gear_coulomb_friction,
    gear_direction_factor,
    gear_load_friction,
    gear_speed_friction,
    gear_viscous_friction,
)

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

# Newton in omega_g: from here on the test for stick comes first [rad/s]; a step of this share of
# the speed leaves a curvature error below 1e-7 of it; torques left unbalanced [N m] of some 1000.
NEAR_REST = 1e-4
STRAIGHT_WITHIN = 1e-3
BALANCED_WITHIN = 1e-5
MAX_NEWTON = 60
SERIES_WITHIN = 0.03
BISECT_FROM = 8


def frictionless(gear_speed: float, s: Record, p: Record) -> tuple[float, float]:
    """Sum of torques that the gear's friction has to balance, and its slope, at omega_g [N m].

    J_g/a omega_g - momentum - xi T_mg + T_gd, which rises with omega_g.
    """
    xi, coupling = p.gear_ratio, s.motor_coupling
    torque = s.motor_offset + coupling * xi * gear_speed
    omega_m = slipping(torque, s.motor_coulomb_friction) * s.motor_compliance
    s.motor_shaft_torque = s.twist_torque + coupling * (omega_m - xi * gear_speed)
    s.next_motor_speed = omega_m
    s.drum_shaft_torque, slope = drum_side(gear_speed, s, p)
    total = s.gear_inertia * gear_speed - s.gear_momentum - xi * s.motor_shaft_torque
    sticking = omega_m == 0.0 and s.motor_coulomb_friction > 0.0
    share = 0.0 if sticking else coupling * s.motor_compliance
    slope += s.gear_inertia + xi * xi * coupling * (1.0 - share)
    return total + s.drum_shaft_torque, slope


def further_friction(gear_speed: float, s: Record, p: Record) -> float:
    """Friction by speed and by load [N m] where `frictionless` has just been evaluated."""
    s.gear_speed = gear_speed
    s.gear_further_friction = gear_speed_friction(s, p) + gear_load_friction(s, p)
    return s.gear_further_friction


def turn(direction: float, s: Record, p: Record) -> None:
    """Let the friction be that of another direction."""
    if direction != s.gear_direction:
        s.gear_direction = direction
        s.gear_direction_factor = gear_direction_factor(s, p)
        s.gear_coulomb_friction = gear_coulomb_friction(s, p)
        s.gear_viscous_friction = gear_viscous_friction(s, p)


def gear_speed_of(s: Record, p: Record) -> float:
    """Root of the scalar equation in omega_g [rad/s]: stick, or Newton on the sliding side.

    While the gear turns, the side is that of the estimate; the test for stick is made when the
    estimate is near rest or Newton would step across it.
    """
    estimate = s.gear_speed
    if abs(estimate) > NEAR_REST:
        speed = slide(abs(estimate), 1.0 if estimate > 0.0 else -1.0, False, s, p)
        if speed > 0.0:
            return speed if estimate > 0.0 else -speed
    at_rest, _ = frictionless(0.0, s, p)
    direction = 0.0
    if at_rest != 0.0:
        direction = -1.0 if at_rest > 0.0 else 1.0
    turn(direction, s, p)
    level = s.gear_direction_factor * s.gear_coulomb_friction + further_friction(0.0, s, p)
    if abs(at_rest) <= level:
        s.gear_friction_torque = -at_rest
        return 0.0
    return direction * slide(NEAR_REST, direction, True, s, p)


def power(speed: float, s: Record, p: Record) -> float:
    """speed^delta_g by its series around the last place it was computed at [(rad/s)^delta_g].

    A power takes a tenth of a run; six terms within 3 % leave an error below 1e-11.
    """
    n = p.gear_friction_exponent
    e = speed * s.power_per_speed - 1.0
    if abs(e) > SERIES_WITHIN:
        s.power_per_speed = 1.0 / speed
        s.power_found = speed**n
        return s.power_found
    high = 1.0 + (n - 3.0) / 4.0 * e * (1.0 + (n - 4.0) / 5.0 * e * (1.0 + (n - 5.0) / 6.0 * e))
    return s.power_found * (
        1.0 + n * e * (1.0 + (n - 1.0) / 2.0 * e * (1.0 + (n - 2.0) / 3.0 * e * high))
    )


def slide(speed: float, direction: float, certain: bool, s: Record, p: Record) -> float:
    """Newton for |omega_g| on one side of rest, from `speed` [rad/s]; friction and slope to s.

    Only the friction is curved. Once a step is small its curvature is negligible, and all that is
    left to check is whether contact or stick changed on the way: one look at the new point,
    without a power. A step across rest gives -|speed|, and the caller tests for stick; where the
    root is known to lie on this side (`certain`) it goes half the way to rest instead. Corners of
    both kinds (contact, a motor that sticks) can make Newton go to and fro: the root stays
    bracketed, and after some steps every other one halves the bracket.
    """
    delta_g = p.gear_friction_exponent
    level = s.gear_direction_factor * s.gear_coulomb_friction
    f_g = s.gear_direction_factor * s.gear_viscous_friction
    lower, upper = 0.0, inf
    total, slope = frictionless(direction * speed, s, p)
    further = further_friction(direction * speed, s, p)
    for attempt in range(MAX_NEWTON):
        viscous = f_g * power(speed, s, p)
        rise = delta_g * viscous / speed
        left = direction * total + (level + further) + viscous
        lower, upper = (speed, upper) if left < 0.0 else (lower, speed)
        step = -left / (slope + rise)
        if step <= -speed and not certain:
            return -speed
        newton = lower <= speed + step <= upper and speed + step > 0.0
        if not newton or (attempt >= BISECT_FROM and attempt % 2 == 0 and upper < inf):
            step = 0.5 * (lower + upper) - speed
        speed += step
        viscous += rise * step
        total, slope = frictionless(direction * speed, s, p)
        further = further_friction(direction * speed, s, p)
        left = direction * total + (level + further) + viscous
        if abs(step) <= STRAIGHT_WITHIN * speed and abs(left) <= BALANCED_WITHIN:
            break
    else:
        s.newton_failed = 1.0
    s.gear_friction_torque = direction * (level + further + viscous)
    return speed
