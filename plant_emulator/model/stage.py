"""Names of the states, and of all fields of the record that one implicit stage works on."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

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

# Start of a run in the backlash gap: (theta_g - theta_d) / alpha, -1 to 1 [1]; +1: the driving
# flank is in contact.
GAP_POSITION = "gap_position"

# All fields that a stage reads or writes. The kernel adds the memories of the effects at the end.
# README.md beside this file gives letter, unit and meaning of each.
STAGE = (
    *STATES,
    # inputs, and their time
    "time",
    "delayed_reference",
    "wheel_torque",
    "brake_torque",
    "parked",
    "truck",
    # laws at the present estimate
    "reference",
    "speed_limit",
    "current_limit",
    "voltage_limit",
    "integration_at_limit",
    "converter_drop_offset",
    "converter_drop_slope",
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
    # the drive, written by `drive.solve_drive`
    "current_reference",
    "current_reference_slope",
    "wanted_current",
    "wanted_current_slope",
    "current_at_hold",
    "current_at_hold_slope",
    "wanted_voltage",
    "wanted_voltage_slope",
    "voltage_at_hold",
    "voltage_at_hold_slope",
    "armature_voltage",
    "unsettled",
    "current_slope",
    "speed_integral_slope",
    "current_integral_slope",
    "power_found",
    "power_per_speed",
    "newton_failed",
    # the gear's friction, written by `gear.solve_gear_speed`
    "gear_direction",
    "gear_direction_factor",
    "gear_further_friction",
    # torques
    "motor_shaft_torque",
    "gear_friction_torque",
    "drum_shaft_torque",
    # coefficients of the linear elements, written by `implicit_stage.prepare_motor`
    "motor_compliance",
    "motor_offset",
    "motor_coupling",
    "twist_torque",
    "next_motor_speed",
    # and by `drum.prepare_drum`
    "gear_inertia_over_step",
    "gear_offset",
    "drum_compliance",
    "drum_offset",
    "contact_offset",
    "contact_slope",
    "contact_stiffness",
)


def split_gap_position(values: Mapping[str, float]) -> tuple[dict[str, float], float]:
    """Values of a run without its gap position, and that position [1]; KeyError if it has none."""
    others = dict(values)
    return others, others.pop(GAP_POSITION)
