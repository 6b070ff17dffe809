"""What the state vector and the record of one implicit stage hold, by name."""

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

# Everything that a stage reads and finds; the memories of the effects are added behind.
STAGE = (
    *STATES,
    # what acts from outside, and when
    "time",
    "delayed_reference",
    "wheel_torque",
    "brake_torque",
    "parked",
    "truck",
    # the laws at the present estimate
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
    # the gear's friction, found by `friction.gear_speed_of`
    "gear_direction",
    "gear_direction_factor",
    "gear_further_friction",
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


def split_gap_position(values: Mapping[str, float]) -> tuple[dict[str, float], float]:
    """Values of a run without its gap position, and that position [1]; KeyError if it has none."""
    others = dict(values)
    return others, others.pop(GAP_POSITION)
