"""The rolling loss of the truck's tyre on the drum rises with the square of the speed.

    T_d = ... - r_d F (1 + (v / v_2)^2) sgn omega_d,   v = r_d omega_d

Source: H. B. Pacejka, Tyre and Vehicle Dynamics, on rolling resistance against speed. F = 0: no
loss. Needs a truck.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "wheel_contact"
PARAMETERS = {
    "force": EffectParameter(
        neutral=0.0, lower=0.0, upper=2e3, plausible=150.0, unit="N", meaning="F"
    ),
    "speed_of_double": EffectParameter(
        neutral=7.0, lower=1.0, upper=1e3, plausible=7.0, unit="m/s", meaning="v_2"
    ),
}


def drum_coulomb_friction(value: float, s: Record, p: Record) -> float:
    """Coulomb friction on the drum [N m]."""
    return value + s.truck * p.drum_radius * p.rising_rolling_loss_force


def drum_viscous_friction(value: float, s: Record, p: Record) -> float:
    """Torque of the rising part divided by the drum speed [N m s/rad]."""
    doubled = p.rising_rolling_loss_speed_of_double
    speed = p.drum_radius * abs(s.drum_speed)
    share: float = p.drum_radius**2 * speed / (doubled * doubled)
    return value + s.truck * p.rising_rolling_loss_force * share
