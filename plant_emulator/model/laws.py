"""Constitutive laws of the bench, one function each. An effect acts by changing laws.

Every law is called as `law(s, p)`. s is the record of the implicit stage that is being solved; it
holds the present estimate of all speeds, torques and currents (`stage.STAGE`). p is the flat record
of the parameter values.

An effect changes a law by a function of the same name, `law(value, s, p)` (see `effects`). `value`
is the result of the nominal law and of all effects before. The kernel chains these functions. A law
whose nominal value is 0 or 1 stands for a term that the thesis neglects.

All laws are plain scalar arithmetic, so that they run compiled and uncompiled alike. Indices of
angles and speeds: m motor side, g gear output, d drum. All values are SI.
"""

from __future__ import annotations

from types import FunctionType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

# Temperature of the gearbox's shell at which the nominal friction holds, 32 degC [K] (thesis,
# section 3.5, Fig 3.6).
NOMINAL_SHELL_TEMPERATURE = 305.15

# --- drive ------------------------------------------------------------------------------------


def dead_time(s: Record, p: Record) -> float:
    """Dead time from the reference of the PLC to that of the drive [s] (thesis, eq. 3.7)."""
    return p.dead_time


def reference(s: Record, p: Record) -> float:
    """Speed reference that the drive acts on, after its dead time [rad/s] (thesis, eq. 3.7)."""
    return s.delayed_reference


def speed_limit(s: Record, p: Record) -> float:
    """Largest speed reference [rad/s] (thesis, eq. 3.6)."""
    return p.speed_limit


def current_limit(s: Record, p: Record) -> float:
    """Largest current reference [A] (thesis, eq. 3.5)."""
    return p.armature_current_limit


def voltage_limit(s: Record, p: Record) -> float:
    """Largest armature voltage [V] (thesis, eq. 3.4)."""
    return p.voltage_limit


def integration_at_limit(s: Record, p: Record) -> float:
    """Share of an error that an integrator takes in although it leads further into the limit [1].

    0 is conditional integration. The thesis does not state its anti-windup; this is the usual one.
    """
    return 0.0


def converter_voltage_drop(s: Record, p: Record) -> float:
    """Voltage that the converter loses between the voltage demand and the armature [V]."""
    return 0.0


def tachometer_gain(s: Record, p: Record) -> float:
    """Ratio of the measured to the true motor speed [1]; drive and log read the measured one."""
    return 1.0


# --- motor ------------------------------------------------------------------------------------


def resistance(s: Record, p: Record) -> float:
    """Armature resistance [ohm]."""
    return p.armature_resistance


def flux(s: Record, p: Record) -> float:
    """Flux k Phi [N m/A], equally [V s/rad].

    k Phi = min(K_m, K_1 / (K_2 + |omega_m|))                       (thesis, eq. 3.16-3.18)

    The thesis asks for the constant flux "until" the weakened flux is lower: hence the minimum. The
    law holds for both directions of rotation: hence |omega_m|.
    """
    weakened = p.flux_constant_1 / (p.flux_constant_2 + abs(s.motor_speed))
    return min(p.flux_constant, weakened)


def motor_coulomb_friction(s: Record, p: Record) -> float:
    """Coulomb friction of the motor [N m], >= 0; the thesis neglects it (eq. 3.9)."""
    return 0.0


def motor_viscous_friction(s: Record, p: Record) -> float:
    """Viscous friction coefficient of the motor [N m s/rad], >= 0; neglected by the thesis."""
    return 0.0


# --- shafts and gear --------------------------------------------------------------------------


def motor_shaft_damping(s: Record, p: Record) -> float:
    """Damping of the shaft between motor and gear [N m s/rad], motor side; neglected (eq. 3.23)."""
    return 0.0


def gear_coulomb_friction(s: Record, p: Record) -> float:
    """Coulomb friction f_gc of the gear at its output [N m], >= 0.

    T_f = (f_gc + f_g |omega_g|^delta_g) sign(omega_g)              (thesis, eq. 3.27; see `gear`)
    """
    return p.gear_coulomb_friction


def gear_viscous_friction(s: Record, p: Record) -> float:
    """Coefficient f_g of the gear's viscous friction [N m (s/rad)^delta_g] (thesis, eq. 3.27)."""
    return p.gear_viscous_friction


def gear_direction_factor(s: Record, p: Record) -> float:
    """Factor on the gear friction of eq. 3.27 in the direction s.gear_direction [1].

    This law and the next two are evaluated at direction, speed and torques of the solution itself
    (see `gear`). An effect on these three laws may depend on them.
    """
    return 1.0


def gear_speed_friction(s: Record, p: Record) -> float:
    """Further friction of the gear [N m], by its speed s.gear_speed; it may fall with the speed."""
    return 0.0


def gear_load_friction(s: Record, p: Record) -> float:
    """Further friction of the gear [N m], by its load s.motor_shaft_torque, s.drum_shaft_torque.

    Its change must stay below the change of the load itself.
    """
    return 0.0


def gear_torque(s: Record, p: Record) -> float:
    """Further torque that acts against positive speed of the gear output [N m]."""
    return 0.0


def backlash_half_gap(s: Record, p: Record) -> float:
    """Half of the backlash gap, at the gear output [rad] (thesis, eq. 3.31)."""
    return p.backlash_half_gap


# --- drum -------------------------------------------------------------------------------------


def drum_coulomb_friction(s: Record, p: Record) -> float:
    """Coulomb friction of the drum bearings [N m], >= 0; neglected by the thesis (eq. 3.34)."""
    return 0.0


def drum_viscous_friction(s: Record, p: Record) -> float:
    """Viscous friction coefficient of the drum bearings [N m s/rad], >= 0; neglected (eq. 3.34)."""
    return 0.0


def drum_torque(s: Record, p: Record) -> float:
    """Torque of the truck on the drum [N m], (r_d / r_w) T_w (thesis, eq. 4.5)."""
    return p.drum_radius / p.wheel_radius * s.wheel_torque


# --- sensors ----------------------------------------------------------------------------------


def measured_drum_speed(s: Record, p: Record) -> float:
    """Drum speed that the measuring wheel shows [rad/s]."""
    return s.drum_speed


def measured_armature_current(s: Record, p: Record) -> float:
    """Armature current that the sensor shows [A]."""
    return s.armature_current


def measured_shaft_torque(s: Record, p: Record) -> float:
    """Shaft torque that the sensor shows [N m], -T_mg, negative while the motor drives (3.26)."""
    return -s.motor_shaft_torque


def shell_temperature(s: Record, p: Record) -> float:
    """Shell temperature that the thermocouples show [K]; the nominal bench is warm."""
    return NOMINAL_SHELL_TEMPERATURE


# Every law above, in the order of this file: the one list of all laws.
LAWS = tuple(
    law
    for law in list(vars().values())
    if isinstance(law, FunctionType) and law.__module__ == __name__
)
