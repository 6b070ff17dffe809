"""The truck's tyre takes a rolling loss from the drum, which it deforms on.

    T_d = ... - r_d F sgn omega_d

Source: ISO 28580 (rolling resistance of tyres, measured on a drum). F is the force at the tyre's
tread, about 1 % of the load on the wheel; the truck's torque does not contain it. Only with a
truck.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.kernel_types import Record

SUBSYSTEM = "wheel_contact"
NEEDS = "a run with a truck on the drum"
PARAMETERS = {
    "force": EffectParameter(
        neutral=0.0, lower=0.0, upper=2e3, plausible=150.0, unit="N", meaning="F"
    ),
}


def drum_coulomb_friction(value: float, s: Record, p: Record) -> float:
    """Coulomb friction on the drum [N m]."""
    return value + s.truck * p.drum_radius * p.tyre_rolling_loss_force
