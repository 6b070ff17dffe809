"""The effects that a case may hide: every effect of the library, and some outside it.

Each effect of the library is simulated with another law, if physics offers one. A sensor's constant
or proportional error and the weight of an imbalance have only one law, that of the library.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    Range = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Entry:
    """An effect that a case may hide.

    effect : name of the effect; law : name of the law that simulates it
    programs : programs that the effect needs in addition to programs 1 to 3
    ranges : of the parameters that are not drawn around their plausible value [SI]
    starts : ranges of the parameters that belong to one run [SI]
    """

    effect: str
    law: str
    programs: tuple[str, ...] = ()
    ranges: Mapping[str, Range] = field(default_factory=dict)
    starts: Mapping[str, Range] = field(default_factory=dict)


# Oil temperature to which the nominal friction belongs: a gear that has run for a while [K].
WARM_OIL = {"nominal_temperature": (303.15, 323.15)}
ANY_ANGLE = (-3.14, 3.14)
# Temperatures of oil and shell at the start of a run: a bench in a hall [K].
OIL = {"start_temperature": (287.0, 306.0), "shell_temperature": (288.0, 303.0)}

INSIDE = (
    # The steepest ramps of the programs exceed these slopes. A steeper limit would have no effect.
    Entry(
        effect="reference_ramp_limit",
        law="rounded_ramp",
        ranges={"ramp_time": (4.5, 16.0)},
    ),
    Entry(effect="reference_filter", law="three_lag_reference"),
    Entry(effect="delay_jitter", law="two_valued_delay"),
    # The programs reach these limits, and the bench still moves with them.
    Entry(
        effect="current_limit",
        law="knee_current_limit",
        programs=("program4",),
        ranges={"reduction": (44.0, 54.0)},
    ),
    # Above this range a braking current lowers the voltage that limits it, and grows without bound.
    Entry(
        effect="voltage_sag",
        law="progressive_voltage_sag",
        programs=("program4",),
        ranges={"source_resistance": (0.35, 0.9)},
    ),
    Entry(
        effect="converter_dead_time",
        law="tanh_converter",
        starts={"mains": (49.95, 50.05), "phase": ANY_ANGLE},
    ),
    Entry(
        effect="integrator_windup",
        law="fading_windup",
        programs=("program4",),
        ranges={"share": (0.5, 1.0)},
    ),
    Entry(effect="motor_friction", law="palmgren_motor"),
    Entry(effect="armature_reaction", law="knee_armature_reaction", programs=("program4",)),
    Entry(effect="field_lag", law="field_lag_with_eddies"),
    Entry(
        effect="armature_resistance_heating",
        law="two_body_heating",
        starts={"start_rise": (-10.0, 60.0)},
    ),
    Entry(effect="shaft_damping", law="rubber_coupling"),
    Entry(effect="gear_oil_temperature", law="vogel_oil", ranges=WARM_OIL, starts=OIL),
    Entry(effect="stribeck", law="lorentzian_stribeck"),
    Entry(effect="presliding", law="elastoplastic_presliding"),
    Entry(effect="load_dependent_gear_loss", law="mixed_film_gear", programs=("program6",)),
    Entry(effect="gear_eccentricity", law="runout_two_harmonics", starts={"phase": ANY_ANGLE}),
    Entry(effect="friction_asymmetry", law="coulomb_asymmetry"),
    Entry(effect="drum_bearing_friction", law="shear_thinning_drum"),
    Entry(effect="drum_imbalance", law="drum_imbalance", starts={"start_angle": ANY_ANGLE}),
    Entry(effect="torque_sensor_offset", law="torque_sensor_offset"),
    Entry(effect="torque_sensor_gain", law="torque_sensor_gain"),
    Entry(effect="torque_sensor_lag", law="bessel_torque_sensor"),
    Entry(effect="torque_sensor_drift", law="creeping_torque_drift"),
    Entry(effect="drum_speed_scale", law="drum_speed_scale"),
    Entry(effect="drum_speed_lag", law="two_lag_drum_speed"),
    Entry(effect="drum_speed_slip", law="saturating_wheel_slip"),
    Entry(effect="motor_speed_scale", law="motor_speed_scale"),
    Entry(effect="wheel_slip", law="progressive_tyre_slip", programs=("program6",)),
    Entry(effect="tyre_rolling_loss", law="rising_rolling_loss", programs=("program6",)),
)
OUTSIDE = (
    Entry(effect="torque_ripple", law="torque_ripple", starts={"phase": ANY_ANGLE}),
    Entry(effect="mesh_ripple", law="mesh_ripple", starts={"phase": ANY_ANGLE}),
    Entry(effect="hysteretic_torque_sensor", law="hysteretic_torque_sensor"),
    Entry(effect="widening_backlash", law="widening_backlash"),
    Entry(effect="oval_measuring_wheel", law="oval_measuring_wheel", starts={"phase": ANY_ANGLE}),
    Entry(effect="two_mass_drum", law="two_mass_drum"),
    Entry(effect="coarse_reference", law="coarse_reference"),
)
