"""The equations of motion and the solution of one implicit stage, X = base + a f(X).

States, by their index in the vector:
    0  int e_s   integral of the speed error [rad]
    1  int e_c   integral of the current error [A s]
    2  i         armature current [A]
    3  omega_m   motor speed [rad/s]
    4  q         twist of the motor shaft at the motor, theta_m - xi theta_g [rad]
    5  omega_g   speed of the gear output [rad/s]
    6  d         angle over the backlash, theta_g - theta_d [rad]
    7  omega_d   drum speed [rad/s]
    8 ...        memories of the effects
Equations (thesis, eq. 3.10, 3.20-3.31, 3.34; it neglects T_mw and T_dw, see `laws`):
    J_m omega_m' = k Phi i - T_mg - T_mw         T_mg = k_mg q
    J_g omega_g' = xi T_mg - T_gd - T_f          T_f  = (f_gc + f_g |omega_g|^delta_g) sgn omega_g
    J_d omega_d' = T_gd + T_d - T_dw             T_gd = k_gd D_alpha(d + c/k_gd d')
    q' = omega_m - xi omega_g                    d'   = omega_g - omega_d

How a stage is solved:
 1. The drive makes i a function of omega_m, linearised at the present estimate (`drive`).
 2. Motor and motor shaft make omega_m a linear function of omega_g (`prepare_motor`).
 3. Drum and dead zone make T_gd a piecewise linear function of omega_g (`drum`).
 4. One monotone scalar equation in omega_g is left (`gear`). Sticking is a test; sliding takes one
    or two Newton steps.
These passes are repeated until linearisation and laws agree with the solution. Nothing is smoothed:
with Coulomb friction a body sticks while all other torques stay within its friction level.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.model.drive import (
    flux_slope,
    keeps_limits,
    linearise_drop,
    move_drive,
    solve_drive,
)
from plant_emulator.model.drum import prepare_drum
from plant_emulator.model.gear import solve_gear_speed
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
# After this many passes each pass goes half of the way: passes can swing between two limits of the
# drive.
UNDAMPED_PASSES = 10
# Largest change of the motor speed since back-EMF and flux were linearised that needs no second
# pass [rad/s]. The error left is of second order, (0.05 / 190)^2 < 1e-7.
LINEAR_WITHIN = 0.05
# Largest relative change of a law between estimate and solution that needs no other pass [1].
LAW_WITHIN = 1e-7
# Brake torque of a parked truck [N m]: more than any torque of this bench.
PARKED = 1e9


def drum_friction_level(s: Record, p: Record) -> float:
    """Coulomb friction on the drum [N m]: bearings, brake of the truck, parked truck."""
    brake = p.drum_radius / p.wheel_radius * s.brake_torque + PARKED * s.parked
    return drum_coulomb_friction(s, p) + brake


def evaluate_laws(s: Record, p: Record) -> None:
    """Evaluate the laws at the present estimate and write them to s."""
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


def has_moved(now: float, before: float) -> bool:
    """Whether a law has moved by more than LAW_WITHIN of its value, or is not a number."""
    return not (now == before or abs(now - before) <= LAW_WITHIN * abs(before))


def laws_have_moved(change: float, s: Record, p: Record) -> bool:
    """Whether a law at the solution differs from the value that the stage was solved with.

    change : change of the motor speed since the flux was linearised [rad/s]
    """
    return (
        has_moved(flux(s, p), s.flux + s.flux_slope * change)
        or has_moved(gear_viscous_friction(s, p), s.gear_viscous_friction)
        or has_moved(gear_coulomb_friction(s, p), s.gear_coulomb_friction)
        or has_moved(gear_direction_factor(s, p), s.gear_direction_factor)
        or has_moved(gear_speed_friction(s, p) + gear_load_friction(s, p), s.gear_further_friction)
        or has_moved(gear_torque(s, p), s.gear_torque)
        or has_moved(backlash_half_gap(s, p), s.backlash_half_gap)
        or has_moved(drum_torque(s, p), s.drum_torque)
        or has_moved(drum_friction_level(s, p), s.drum_coulomb_friction)
        or has_moved(drum_viscous_friction(s, p), s.drum_viscous_friction)
        or has_moved(motor_shaft_damping(s, p), s.motor_shaft_damping)
        or has_moved(tachometer_gain(s, p), s.tachometer_gain)
        or has_moved(integration_at_limit(s, p), s.integration_at_limit)
        or has_moved(speed_limit(s, p), s.speed_limit)
        or has_moved(motor_coulomb_friction(s, p), s.motor_coulomb_friction)
        or has_moved(motor_viscous_friction(s, p), s.motor_viscous_friction)
        or has_moved(reference(s, p), s.reference)
        or has_moved(resistance(s, p), s.resistance)
        or has_moved(
            converter_voltage_drop(s, p),
            s.converter_drop_offset + s.converter_drop_slope * s.armature_current,
        )
        or has_moved(voltage_limit(s, p), s.voltage_limit)
        or has_moved(current_limit(s, p), s.current_limit)
    )


def prepare_motor(base: State, a: float, s: Record, p: Record) -> None:
    """Write the coefficients of omega_m as a function of omega_g.

    (J_m/a + B + S - dT/domega) omega_m + T_c sgn omega_m = R + S xi omega_g,  S = k_mg a + damping

    T is the motor's torque, from the drive linearised at s.motor_speed.

    base : states that the stage starts from; a : implicit step [s]
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
    """Torque of the truck at its wheel, including the reaction of its brake [N m].

    At standstill the reaction of the brake balances all other torques on the drum. While the log
    itself has the truck parked, the torque is the logged one.
    """
    if s.brake_torque == 0.0 or s.parked > 0.0:
        return s.wheel_torque
    total = s.drum_offset + s.drum_shaft_torque - s.drum_speed / s.drum_compliance
    held = total * p.wheel_radius / p.drum_radius
    return s.wheel_torque - max(-s.brake_torque, min(s.brake_torque, held))


def load(x: State, s: Record) -> None:
    """Copy the states from the vector x to s. The kernel generates the body, memories included."""


def store(s: Record, x: State) -> None:
    """Copy the states from s to the vector x. The kernel generates the body, memories included."""


def advance_memories(base: State, a: float, s: Record, p: Record) -> None:
    """Solve the implicit stages of the effects' memories. The nominal model has no memories.

    The kernel generates the body from the effects.
    """


def show(x: State, s: Record, p: Record) -> None:
    """Write the states x to s, and the laws, the voltage and the shaft torque at these states."""
    load(x, s)
    evaluate_laws(s, p)
    solve_drive(x, 0.0, s, p)
    damped = s.motor_shaft_damping * (s.motor_speed - p.gear_ratio * s.gear_speed)
    s.motor_shaft_torque = p.motor_shaft_stiffness * s.motor_shaft_twist + damped


def solve_stage(base: State, a: float, s: Record, p: Record) -> None:
    """Solve X = base + a f(X) for X. On entry s holds an estimate of X, on return the solution.

    A stage that is not solved after MAX_PASSES is counted in s.unsettled.

    base : states that the stage starts from; a : implicit step, gamma h [s]
    """
    for attempt in range(MAX_PASSES):
        if s.gear_speed != 0.0:
            s.gear_direction = 1.0 if s.gear_speed > 0.0 else -1.0
        evaluate_laws(s, p)
        solve_drive(base, a, s, p)
        prepare_motor(base, a, s, p)
        prepare_drum(base, a, s, p)
        s.newton_failed = 0.0
        s.gear_speed = solve_gear_speed(s, p)
        change = s.next_motor_speed - s.motor_speed
        settled = (
            abs(change) <= LINEAR_WITHIN and keeps_limits(change, s) and s.newton_failed == 0.0
        )
        if settled:
            move_drive(change, s)
        elif attempt >= UNDAMPED_PASSES:
            change *= 0.5
        s.motor_speed += change
        s.motor_shaft_twist = base[TWIST] + a * (s.motor_speed - p.gear_ratio * s.gear_speed)
        s.backlash_angle = base[BACKLASH] + a * (s.gear_speed - s.drum_speed)
        advance_memories(base, a, s, p)
        if settled and not laws_have_moved(change, s, p):
            return
    s.unsettled += 1.0
