"""The gear: its speed at the end of an implicit stage, from one scalar equation.

    J_g/a omega_g - offset - xi T_mg(omega_g) + T_gd(omega_g) + T_f = 0

T_mg and T_gd are linear or piecewise linear in omega_g (`implicit_stage.prepare_motor`, `drum`).
The friction T_f is set-valued at rest, so that sticking is decided by a test. While the gear turns

    T_f = d [k(d) (T_c + f_g |omega_g|^delta_g) + T_s(omega_g) + T_l(T_mg, T_gd)]

d : direction of the friction, `s.gear_direction`. It is the sign of omega_g. At rest it is the sign
    of the torque that drives the gear, or 0 where there is none.
k, T_s, T_l : laws that the thesis does not have (1, 0, 0). Each is evaluated at direction, speed
    and torques of the solution itself, so that an effect may use them. A law that used an estimate
    could swing between two directions.

T_s may fall with the speed (Stribeck). Newton's slope omits T_s and T_l, because both are small
against the motor's inertia over the stage, xi^2 J_m / a. The root stays bracketed in any case.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

from plant_emulator.model.drum import drum_shaft_torque, torque_beyond_friction
from plant_emulator.model.laws import (
    gear_coulomb_friction,
    gear_direction_factor,
    gear_load_friction,
    gear_speed_friction,
    gear_viscous_friction,
)

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

# Below this speed the test for sticking comes before Newton's steps [rad/s].
NEAR_REST = 1e-4
# A Newton step below this share of the speed leaves a curvature error below 1e-7 of the speed.
STRAIGHT_WITHIN = 1e-3
# Largest torque that Newton may leave unbalanced [N m]; the torques are of the order of 1000.
BALANCED_WITHIN = 1e-5
MAX_NEWTON = 60
# From this step on every other step halves the bracket.
BISECT_FROM = 8
# Relative change of the speed within which `power` uses its series [1].
SERIES_WITHIN = 0.03


def frictionless_torque(gear_speed: float, s: Record, p: Record) -> tuple[float, float]:
    """Torque that the gear's friction has to balance, and its slope [N m, N m s/rad].

    J_g/a omega_g - offset - xi T_mg + T_gd. It rises with omega_g. Shaft torques and the speeds of
    motor and drum that go with omega_g are written to s.

    gear_speed : omega_g at the end of the stage [rad/s]
    """
    xi, coupling = p.gear_ratio, s.motor_coupling
    torque = s.motor_offset + coupling * xi * gear_speed
    omega_m = torque_beyond_friction(torque, s.motor_coulomb_friction) * s.motor_compliance
    s.motor_shaft_torque = s.twist_torque + coupling * (omega_m - xi * gear_speed)
    s.next_motor_speed = omega_m
    s.drum_shaft_torque, slope = drum_shaft_torque(gear_speed, s, p)
    total = s.gear_inertia_over_step * gear_speed - s.gear_offset - xi * s.motor_shaft_torque
    sticking = omega_m == 0.0 and s.motor_coulomb_friction > 0.0
    share = 0.0 if sticking else coupling * s.motor_compliance
    slope += s.gear_inertia_over_step + xi * xi * coupling * (1.0 - share)
    return total + s.drum_shaft_torque, slope


def further_friction(gear_speed: float, s: Record, p: Record) -> float:
    """Friction by speed and by load [N m]; `frictionless_torque` must come just before it."""
    s.gear_speed = gear_speed
    s.gear_further_friction = gear_speed_friction(s, p) + gear_load_friction(s, p)
    return s.gear_further_friction


def set_direction(direction: float, s: Record, p: Record) -> None:
    """Set the direction of the friction, -1, 0 or 1, and evaluate the laws that depend on it."""
    if direction != s.gear_direction:
        s.gear_direction = direction
        s.gear_direction_factor = gear_direction_factor(s, p)
        s.gear_coulomb_friction = gear_coulomb_friction(s, p)
        s.gear_viscous_friction = gear_viscous_friction(s, p)


def solve_gear_speed(s: Record, p: Record) -> float:
    """Solve the scalar equation for omega_g [rad/s]; 0 where the gear sticks.

    While the gear turns, Newton stays on the side of rest that the estimate is on. The test for
    sticking is made where the estimate is near rest, or where Newton would step across rest.
    """
    estimate = s.gear_speed
    if abs(estimate) > NEAR_REST:
        speed = solve_sliding(abs(estimate), 1.0 if estimate > 0.0 else -1.0, False, s, p)
        if speed > 0.0:
            return speed if estimate > 0.0 else -speed
    at_rest, _ = frictionless_torque(0.0, s, p)
    direction = 0.0
    if at_rest != 0.0:
        direction = -1.0 if at_rest > 0.0 else 1.0
    set_direction(direction, s, p)
    level = s.gear_direction_factor * s.gear_coulomb_friction + further_friction(0.0, s, p)
    if abs(at_rest) <= level:
        s.gear_friction_torque = -at_rest
        return 0.0
    return direction * solve_sliding(NEAR_REST, direction, True, s, p)


def power(speed: float, s: Record, p: Record) -> float:
    """speed^delta_g [(rad/s)^delta_g], by its series about the speed of the last full evaluation.

    Full evaluations would take a tenth of the time of a run. Six terms of the series, within 3 % of
    that speed, leave an error below 1e-11.
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


def solve_sliding(speed: float, direction: float, certain: bool, s: Record, p: Record) -> float:
    """Solve for |omega_g| [rad/s] on one side of rest by Newton's method; the friction goes to s.

    Only the friction is curved. Its curvature is negligible over a small step. After such a step
    one evaluation checks that neither contact nor sticking changed; it needs no full power.

    A step across rest returns -|speed|, and the caller tests for sticking. Where the root certainly
    lies on this side, such a step goes half of the way to rest instead.

    Corners (contact, a motor that sticks) can make Newton swing between two points. Therefore the
    root stays bracketed, and from BISECT_FROM on every other step halves the bracket.

    speed : start [rad/s]; direction : -1 or 1; certain : whether the root lies on this side
    """
    delta_g = p.gear_friction_exponent
    level = s.gear_direction_factor * s.gear_coulomb_friction
    f_g = s.gear_direction_factor * s.gear_viscous_friction
    lower, upper = 0.0, inf
    total, slope = frictionless_torque(direction * speed, s, p)
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
        total, slope = frictionless_torque(direction * speed, s, p)
        further = further_friction(direction * speed, s, p)
        left = direction * total + (level + further) + viscous
        if abs(step) <= STRAIGHT_WITHIN * speed and abs(left) <= BALANCED_WITHIN:
            break
    else:
        s.newton_failed = 1.0
    s.gear_friction_torque = direction * (level + further + viscous)
    return speed
