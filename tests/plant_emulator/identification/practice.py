"""What the independent bench of the practice logs was run with."""

from plant_emulator.model.parameters import ParameterSet

FREE = (
    "flux_constant_1",
    "flux_constant_2",
    "drum_shaft_damping",
    "gear_coulomb_friction",
    "gear_viscous_friction",
    "gear_friction_exponent",
    "backlash_half_gap",
    "drum_inertia",
    "dead_time",
)
# Percent of Table 3.1 (tests/data/README.md).
DEVIATIONS = {
    "practice_002": (-0.3381, -10.8028, 15.7512, 7.0193, 1.1620, -0.8991, 1.0622, 0.6135, 2.0889),
    "practice_008": (0.0790, 11.8866, -3.7832, -11.6864, -1.0671, -2.1532, 4.1425, 8.0, -7.0835),
}


def truth(nominal: ParameterSet, case: str) -> dict[str, float]:
    """The parameters that a case was made with [SI]."""
    deviations = zip(FREE, DEVIATIONS[case], strict=True)
    return {name: nominal.value(name) * (1 + percent / 100) for name, percent in deviations}
