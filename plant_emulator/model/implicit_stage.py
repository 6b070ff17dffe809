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

from typing import TYPE_CHECKING

from plant_emulator.model.drive import armature, flux_slope, linearise_drop, move_drive, same_limits
from plant_emulator.model.drum import prepare_drum
from plant_emulator.model.gear import gear_speed_of
from plant_emulator.model.laws import (
    backlash_half_gap,
    converter_voltage_drop,
    current_limit,
    drum_coulomb_friction,
    drum_torque,
    drum_viscous_friction,
    flux,
    gear_coulomb_friction,
    gear_direction_factor,
    gear_load_friction,
    gear_speed_friction,
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
from plant_emulator.model.stage import BACKLASH, MOTOR_SPEED, TWIST

if TYPE_CHECKING:
    from plant_emulator.model.records import Record, State

MAX_PASSES = 40
# From here on a pass goes half way, should it swing between two limits of the drive.
UNDAMPED_PASSES = 10
# A second pass is made when the motor speed moved further than this from where the back-EMF and
# the flux were linearised [rad/s]; the error left is of second order, (0.05 / 190)^2 < 1e-7.
LINEAR_WITHIN = 0.05
# Relative change of a law between estimate and solution that asks for another pass.
LAW_WITHIN = 1e-7
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
    linearise_drop(s, p)
    s.tachometer_gain = tachometer_gain(s, p)
    s.resistance = resistance(s, p)
    s.flux = flux(s, p)
    s.flux_slope = flux_slope(s.flux, s, p)
    s.motor_coulomb_friction = motor_coulomb_friction(s, p)
    s.motor_viscous_friction = motor_viscous_friction(s, p)
    s.motor_shaft_damping = motor_shaft_damping(s, p)
    s.gear_coulomb_friction = gear_coulomb_friction(s, p)
    s.gear_viscous_friction = gear_viscous_friction(s, p)
    s.gear_direction_factor = gear_direction_factor(s, p)
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
        or moved(gear_direction_factor(s, p), s.gear_direction_factor)
        or moved(gear_speed_friction(s, p) + gear_load_friction(s, p), s.gear_further_friction)
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
        or moved(
            converter_voltage_drop(s, p),
            s.converter_drop_offset + s.converter_drop_slope * s.armature_current,
        )
        or moved(voltage_limit(s, p), s.voltage_limit)
        or moved(current_limit(s, p), s.current_limit)
    )


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
        if s.gear_speed != 0.0:
            s.gear_direction = 1.0 if s.gear_speed > 0.0 else -1.0
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
