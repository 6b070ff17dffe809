"""The truck's tyre takes a rolling loss from the drum, on which it deforms.

    T_d = ... - r_d F (1 + c |v|) sgn omega_d,   v = r_d omega_d

Source: ISO 28580 (rolling resistance of tyres, measured on a drum); SAE J2452 for its rise with the
speed. F is the force at the tyre's tread, about 1 % of the load on the wheel. The truck's torque
does not contain it. The effect exists only with a truck.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "wheel_contact"
NEEDS = "a run with a truck on the drum"
PARAMETERS = {
    "force": EffectParameter(
        neutral=0.0, lower=0.0, upper=2e3, plausible=150.0, unit="N", meaning="F"
    ),
    "rise": EffectParameter(
        neutral=0.0, lower=-0.05, upper=0.3, plausible=0.0, unit="s/m", meaning="c", std=0.05
    ),
}


def drum_coulomb_friction(value: float, s: Record, p: Record) -> float:
    """Coulomb friction on the drum [N m]."""
    return value + s.truck * p.drum_radius * p.tyre_rolling_loss_force


def drum_viscous_friction(value: float, s: Record, p: Record) -> float:
    """Viscous friction coefficient on the drum [N m s/rad]."""
    per_speed = p.drum_radius * p.drum_radius * p.tyre_rolling_loss_rise
    return value + s.truck * p.tyre_rolling_loss_force * per_speed
