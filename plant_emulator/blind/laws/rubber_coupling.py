"""A coupling with rubber elements damps the shaft. Its damping grows with the torque.

    T_mg = k_mg q + d (1 + |T_mg| / T_0) (omega_m - xi omega_g)

Source: H. Dresig, F. Holzweissig, Dynamics of Machinery, on couplings with elastomers. d = 0: no
damping.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "motor_shaft"
PARAMETERS = {
    "damping": EffectParameter(
        neutral=0.0, lower=0.0, upper=1e3, plausible=10.0, unit="N m s/rad", meaning="d"
    ),
    "torque_of_double": EffectParameter(
        neutral=50.0, lower=1.0, upper=1e3, plausible=50.0, unit="N m", meaning="T_0"
    ),
}


def motor_shaft_damping(value: float, s: Record, p: Record) -> float:
    """Damping of the shaft at its torque, at the motor [N m s/rad]."""
    if p.rubber_coupling_damping == 0.0:
        return value
    pressed = (
        abs(p.motor_shaft_stiffness * s.motor_shaft_twist) / p.rubber_coupling_torque_of_double
    )
    return value + p.rubber_coupling_damping * (1.0 + pressed)
