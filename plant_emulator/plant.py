"""The equations of motion and the solution of one implicit stage, X = base + a f(X).

States (index in the vector; side in brackets):
    0 int e_s     integral of the speed error [rad]          4 q = theta_m - xi theta_g [rad]
    (motor) 1 int e_c     integral of the current error [A s]        5 omega_g  gear output [rad/s]
    2 i           armature current [A]                       6 d = theta_g - theta_d [rad] (output)
    3 omega_m     motor [rad/s]                              7 omega_d  drum [rad/s] 8...
    memories of the effects
Equations (thesis, eq. 3.10, 3.20-3.31, 3.34; T_mw, T_gw, T_dw: neglected there, see laws):
    J_m omega_m' = k Phi i - T_mg - T_mw         T_mg = k_mg q
    J_g omega_g' = xi T_mg - T_gd - T_f          T_f  = (f_gc + f_g |omega_g|^delta_g) sgn omega_g
    J_d omega_d' = T_gd + T_d - T_dw             T_gd = k_gd D_alpha(d + c/k_gd d')
    q' = omega_m - xi omega_g                    d'   = omega_g - omega_d

How a stage is solved. The drive makes i a function of omega_m (`drive`), linearised at the present
estimate. Motor and shaft make omega_m a linear, drum and dead zone make T_gd a piecewise linear
function of omega_g (with true Coulomb friction: a body sticks where the rest of the torques lies
within its level). What is left is one scalar equation in omega_g, monotone, with the root of
largest curvature at rest: stick is a test, sliding takes one or two Newton steps. The pass is
repeated until the linearisation and the laws agree with what was found. Nothing is smoothed.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

from plant_emulator.drive import armature, flux_slope, move_drive, same_limits
from plant_emulator.laws import (
    backlash_half_gap,
    converter_voltage_drop,
    current_limit,
    drum_coulomb_friction,
    drum_torque,
    drum_viscous_friction,
    flux,
    gear_coulomb_friction,
    gear_torque,
    gear_viscous_friction,
    integration_at_limit,
    motor_coulomb_friction,
    motor_shaft_damping,
    motor_viscous_friction,
    reference,
    resistance,
    speed_limit,
    tachometer_gain,
    voltage_limit,
)

if TYPE_CHECKING:
    from plant_emulator.kernel_types import Record, State

STATES = (
    "speed_integral",
    "current_integral",
    "armature_current",
    "motor_speed",
    "motor_shaft_twist",
    "gear_speed",
    "backlash_angle",
    "drum_speed",
)
MOTOR_SPEED, TWIST, GEAR_SPEED, BACKLASH, DRUM_SPEED = 3, 4, 5, 6, 7
FIRST_MEMORY = 8

# Everything that a stage reads and finds; the memories of the effects are added behind.
STAGE = (
    *STATES,
    # what acts from outside, and when
    "time",
    "delayed_reference",
    "wheel_torque",
    "brake_torque",
    "parked",
    # the laws at the present estimate
    "reference",
    "speed_limit",
    "current_limit",
    "voltage_limit",
    "integration_at_limit",
    "converter_voltage_drop",
    "tachometer_gain",
    "resistance",
    "flux",
    "flux_slope",
    "motor_coulomb_friction",
    "motor_viscous_friction",
    "motor_shaft_damping",
    "gear_coulomb_friction",
    "gear_viscous_friction",
    "gear_torque",
    "backlash_half_gap",
    "drum_coulomb_friction",
    "drum_viscous_friction",
    "drum_torque",
    # the drive, found by `drive.armature`
    "current_reference",
    "current_reference_slope",
    "wanted_current",
    "wanted_current_slope",
    "wanted_voltage",
    "wanted_voltage_slope",
    "armature_voltage",
    "unsettled",
    "current_slope",
    "speed_integral_slope",
    "current_integral_slope",
    "power_found",
    "power_per_speed",
    "newton_failed",
    # torques
    "motor_shaft_torque",
    "gear_friction_torque",
    "drum_shaft_torque",
    "drum_friction_torque",
    # coefficients of the stage's two linear elements, see motor_side and drum_side
    "motor_compliance",
    "motor_offset",
    "motor_coupling",
    "twist_torque",
    "next_motor_speed",
    "gear_inertia",
    "gear_momentum",
    "drum_compliance",
    "drum_offset",
    "contact_offset",
    "contact_slope",
    "contact_stiffness",
)

MAX_PASSES = 40
# From here on a pass goes half way, should it swing between two limits of the drive.
UNDAMPED_PASSES = 10
# A second pass is made when the motor speed moved further than this from where the back-EMF and
# the flux were linearised [rad/s]; the error left is of second order, (0.05 / 190)^2 < 1e-7.
LINEAR_WITHIN = 0.05
# Relative change of a law between estimate and solution that asks for another pass.
LAW_WITHIN = 1e-7
# Newton in omega_g: from here on the test for stick comes first [rad/s]; a step of this share of
# the speed leaves a curvature error below 1e-7 of it; torques left unbalanced [N m] of some 1000.
NEAR_REST = 1e-4
STRAIGHT_WITHIN = 1e-3
BALANCED_WITHIN = 1e-5
MAX_NEWTON = 60
SERIES_WITHIN = 0.03
BISECT_FROM = 8
# A brake that no torque of this bench overcomes [N m]: the parked truck.
PARKED = 1e9


def drum_friction_level(s: Record, p: Record) -> float:
    """Coulomb friction on the drum [N m]: its bearings', the truck's brake, a parked truck."""
    brake = p.drum_radius / p.wheel_radius * s.brake_torque + PARKED * s.parked
    return drum_coulomb_friction(s, p) + brake


def evaluate_laws(s: Record, p: Record) -> None:
    """Write every law at the present estimate into the stage."""
    s.reference = reference(s, p)
    s.speed_limit = speed_limit(s, p)
    s.current_limit = current_limit(s, p)
    s.voltage_limit = voltage_limit(s, p)
    s.integration_at_limit = integration_at_limit(s, p)
    s.converter_voltage_drop = converter_voltage_drop(s, p)
    s.tachometer_gain = tachometer_gain(s, p)
    s.resistance = resistance(s, p)
    s.flux = flux(s, p)
    s.flux_slope = flux_slope(s.flux, s, p)
    s.motor_coulomb_friction = motor_coulomb_friction(s, p)
    s.motor_viscous_friction = motor_viscous_friction(s, p)
    s.motor_shaft_damping = motor_shaft_damping(s, p)
    s.gear_coulomb_friction = gear_coulomb_friction(s, p)
    s.gear_viscous_friction = gear_viscous_friction(s, p)
    s.gear_torque = gear_torque(s, p)
    s.backlash_half_gap = backlash_half_gap(s, p)
    s.drum_coulomb_friction = drum_friction_level(s, p)
    s.drum_viscous_friction = drum_viscous_friction(s, p)
    s.drum_torque = drum_torque(s, p)


def moved(now: float, before: float) -> bool:
    """Whether a law has moved by more than LAW_WITHIN of itself, or is no number."""
    return not (now == before or abs(now - before) <= LAW_WITHIN * abs(before))


def laws_moved(change: float, s: Record, p: Record) -> bool:
    """Whether the laws at the solution differ from those that it was solved with.

    change : what the motor speed has moved since the flux was linearised [rad/s]
    """
    return (
        moved(flux(s, p), s.flux + s.flux_slope * change)
        or moved(gear_viscous_friction(s, p), s.gear_viscous_friction)
        or moved(gear_coulomb_friction(s, p), s.gear_coulomb_friction)
        or moved(gear_torque(s, p), s.gear_torque)
        or moved(backlash_half_gap(s, p), s.backlash_half_gap)
        or moved(drum_torque(s, p), s.drum_torque)
        or moved(drum_friction_level(s, p), s.drum_coulomb_friction)
        or moved(drum_viscous_friction(s, p), s.drum_viscous_friction)
        or moved(motor_shaft_damping(s, p), s.motor_shaft_damping)
        or moved(tachometer_gain(s, p), s.tachometer_gain)
        or moved(integration_at_limit(s, p), s.integration_at_limit)
        or moved(speed_limit(s, p), s.speed_limit)
        or moved(motor_coulomb_friction(s, p), s.motor_coulomb_friction)
        or moved(motor_viscous_friction(s, p), s.motor_viscous_friction)
        or moved(reference(s, p), s.reference)
        or moved(resistance(s, p), s.resistance)
        or moved(converter_voltage_drop(s, p), s.converter_voltage_drop)
        or moved(voltage_limit(s, p), s.voltage_limit)
        or moved(current_limit(s, p), s.current_limit)
    )


def slipping(torque: float, level: float) -> float:
    """Torque left after Coulomb friction of that level [N m]; 0 where the body sticks."""
    if torque > level:
        return torque - level
    if torque < -level:
        return torque + level
    return 0.0


def prepare_motor(base: State, a: float, s: Record, p: Record) -> None:
    """Coefficients of omega_m as a function of omega_g, from the drive linearised at s.motor_speed.

    (J_m/a + B + S - dT/domega) omega_m + T_c sgn omega_m = R + S xi omega_g,  S = k_mg a + damping
    """
    torque_slope = s.flux * s.current_slope + s.flux_slope * s.armature_current
    torque = s.flux * s.armature_current - torque_slope * s.motor_speed
    s.twist_torque = p.motor_shaft_stiffness * base[TWIST]
    s.motor_coupling = p.motor_shaft_stiffness * a + s.motor_shaft_damping
    inertia = p.motor_inertia / a
    resistance = inertia + s.motor_viscous_friction + s.motor_coupling - torque_slope
    s.motor_compliance = 1.0 / resistance
    s.motor_offset = inertia * base[MOTOR_SPEED] + torque - s.twist_torque


def prepare_drum(base: State, a: float, s: Record, p: Record) -> None:
    """Coefficients of T_gd as a function of omega_g (thesis, eq. 3.29-3.31, 3.34).

    D_alpha acts on y = d + (c/k) d' = contact_offset + contact_slope (omega_g - omega_d).
    """
    inertia = p.drum_inertia / a
    s.drum_compliance = 1.0 / (inertia + s.drum_viscous_friction)
    s.drum_offset = inertia * base[DRUM_SPEED] + s.drum_torque
    s.contact_offset = base[BACKLASH]
    s.contact_slope = a + p.drum_shaft_damping / p.drum_shaft_stiffness
    k_gd = p.drum_shaft_stiffness
    s.contact_stiffness = k_gd / (1.0 + k_gd * s.contact_slope * s.drum_compliance)
    s.gear_inertia = p.gear_inertia / a
    s.gear_momentum = s.gear_inertia * base[GEAR_SPEED] - s.gear_torque


def dead_zone(y: float, half_gap: float) -> float:
    """D_alpha(y) [rad] (thesis, eq. 3.31)."""
    if y > half_gap:
        return y - half_gap
    if y < -half_gap:
        return y + half_gap
    return 0.0


def drum_side(gear_speed: float, s: Record, p: Record) -> tuple[float, float]:
    """T_gd and its slope with omega_g [N m, N m s/rad]; omega_d goes to s.drum_speed.

    The drum sticks where dead zone and truck together stay within its Coulomb friction; the brake
    of a truck is part of that friction. Otherwise its equation, linear in T_gd, is eliminated.
    """
    slope, offset, level = s.contact_slope, s.drum_offset, s.drum_coulomb_friction
    y = s.contact_offset + slope * gear_speed
    if level > 0.0:
        k_gd = p.drum_shaft_stiffness
        torque = k_gd * dead_zone(y, s.backlash_half_gap)
        left = slipping(offset + torque, level)
        if left == 0.0:
            s.drum_speed = 0.0
            return torque, k_gd * slope if torque != 0.0 else 0.0
        offset -= level if left > 0.0 else -level
    free = offset * s.drum_compliance
    torque = s.contact_stiffness * dead_zone(y - slope * free, s.backlash_half_gap)
    s.drum_speed = free + torque * s.drum_compliance
    return torque, s.contact_stiffness * slope if torque != 0.0 else 0.0


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
    if abs(at_rest) <= s.gear_coulomb_friction:
        s.gear_friction_torque = -at_rest
        return 0.0
    direction = -1.0 if at_rest > 0.0 else 1.0
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
    level, f_g, delta_g = s.gear_coulomb_friction, s.gear_viscous_friction, p.gear_friction_exponent
    lower, upper = 0.0, inf
    total, slope = frictionless(direction * speed, s, p)
    for attempt in range(MAX_NEWTON):
        viscous = f_g * power(speed, s, p)
        rise = delta_g * viscous / speed
        left = direction * total + level + viscous
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
        left = direction * total + level + viscous
        if abs(step) <= STRAIGHT_WITHIN * speed and abs(left) <= BALANCED_WITHIN:
            break
    else:
        s.newton_failed = 1.0
    s.gear_friction_torque = direction * (level + viscous)
    return speed


def acting_wheel_torque(s: Record, p: Record) -> float:
    """Torque of the truck at its wheel with its brake's share of the drum's friction [N m].

    The brake is the truck's; what it holds back at standstill is its reaction. While the drum is
    parked by a log's own record the torque is the logged one.
    """
    if s.brake_torque == 0.0 or s.parked > 0.0:
        return s.wheel_torque
    total = s.drum_offset + s.drum_shaft_torque - s.drum_speed / s.drum_compliance
    held = total * p.wheel_radius / p.drum_radius
    return s.wheel_torque - max(-s.brake_torque, min(s.brake_torque, held))


def load(x: State, s: Record) -> None:
    """Copy the states of the vector x into the stage; the kernel lays it out with the memories."""


def store(s: Record, x: State) -> None:
    """Copy the states of the stage into the vector x; the kernel lays it out with the memories."""


def memories(base: State, a: float, s: Record, p: Record) -> None:
    """Bring the memories of all effects to the end of the stage: none in the nominal model.

    The kernel puts the effects' own implicit stages in its place.
    """


def show(x: State, s: Record, p: Record) -> None:
    """Write the states x to the stage, and what follows from them: laws, voltage, torque."""
    load(x, s)
    evaluate_laws(s, p)
    armature(x, 0.0, s, p)
    damped = s.motor_shaft_damping * (s.motor_speed - p.gear_ratio * s.gear_speed)
    s.motor_shaft_torque = p.motor_shaft_stiffness * s.motor_shaft_twist + damped


def solve_stage(base: State, a: float, s: Record, p: Record) -> None:
    """Solve X = base + a f(X). On entry s holds an estimate of X, on return the solution.

    a : implicit step, gamma h [s]. A stage whose passes ran out is counted in s.unsettled.
    """
    for attempt in range(MAX_PASSES):
        evaluate_laws(s, p)
        armature(base, a, s, p)
        prepare_motor(base, a, s, p)
        prepare_drum(base, a, s, p)
        s.newton_failed = 0.0
        s.gear_speed = gear_speed_of(s, p)
        change = s.next_motor_speed - s.motor_speed
        settled = abs(change) <= LINEAR_WITHIN and same_limits(change, s) and s.newton_failed == 0.0
        if settled:
            move_drive(change, s)
        elif attempt >= UNDAMPED_PASSES:
            change *= 0.5
        s.motor_speed += change
        s.motor_shaft_twist = base[TWIST] + a * (s.motor_speed - p.gear_ratio * s.gear_speed)
        s.backlash_angle = base[BACKLASH] + a * (s.gear_speed - s.drum_speed)
        memories(base, a, s, p)
        if settled and not laws_moved(change, s, p):
            return
    s.unsettled += 1.0
