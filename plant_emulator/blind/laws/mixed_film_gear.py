"""The gear loses a share of its torque. The share rises with the torque and falls with the speed.

    T_l = a |T_gd| ((|T_gd| / T_0) 2 / (1 + |omega_g| / omega_0))^n,   T_0 = 500 N m

Source: ISO/TR 14179-2 (2001), the coefficient of friction of a mesh: the power n = 0.2 of the load
over the speed, with a mixed film between the teeth. a: share at T_0 and omega_0. a = 0: no
load-dependent loss.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "gear"
PARAMETERS = {
    "share": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.2, plausible=0.05, unit="1", meaning="a"
    ),
    "exponent": EffectParameter(
        neutral=0.2, lower=0.0, upper=0.3, plausible=0.2, unit="1", meaning="n"
    ),
    "film_speed": EffectParameter(
        neutral=2.0, lower=0.01, upper=100.0, plausible=2.0, unit="rad/s", meaning="omega_0"
    ),
}
# Drum torque while a truck of 3 t accelerates by 0.26 m/s^2 [N m].
USUAL_TORQUE = 500.0


def gear_load_friction(value: float, s: Record, p: Record) -> float:
    """Friction at the drum's shaft torque in addition to Coulomb and viscous friction [N m]."""
    share = p.mixed_film_gear_share
    if share == 0.0:
        return value
    torque = abs(s.drum_shaft_torque)
    film = 0.5 * (1.0 + abs(s.gear_speed) / p.mixed_film_gear_film_speed)
    loss: float = share * torque * (torque / USUAL_TORQUE / film) ** p.mixed_film_gear_exponent
    return value + loss
