"""The measuring wheel slips on the drum, the more the harder the drum accelerates.

    omega_meas = (1 - k omega_d' (|omega_d'| / (1 rad/s^2))^(n - 1)) omega_d

Source: H. B. Pacejka, Tyre and Vehicle Dynamics, on longitudinal slip. Small slip is proportional
to the force (n = 1). The force here accelerates the wheel's own inertia J_w, so that
k = J_w r_d / (C r_w^2), with the wheel's radius r_w and its slip stiffness C. Larger slip grows
faster where the contact slides (n > 1), and slower where the tread stiffens (n < 1). While the drum
slows down, the wheel runs ahead of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "speed_sensor"
PARAMETERS = {
    "slip_per_acceleration": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.2, plausible=0.01, unit="s^2/rad", meaning="k"
    ),
    "exponent": EffectParameter(
        neutral=1.0, lower=0.3, upper=1.5, plausible=1.0, unit="1", meaning="n", std=0.25
    ),
}

# Below this acceleration the slip is proportional to it, so that its slope stays finite [rad/s^2].
SLOW = 0.02


def acceleration(s: Record, p: Record) -> float:
    """Acceleration of the drum while it turns [rad/s^2]."""
    friction = s.drum_viscous_friction * s.drum_speed
    if s.drum_speed != 0.0:
        friction += s.drum_coulomb_friction if s.drum_speed > 0.0 else -s.drum_coulomb_friction
    return (s.drum_shaft_torque + s.drum_torque - friction) / p.drum_inertia


def measured_drum_speed(value: float, s: Record, p: Record) -> float:
    """Drum speed that the measuring wheel shows [rad/s]."""
    k = p.drum_speed_slip_slip_per_acceleration
    if k == 0.0:
        return value
    rate = acceleration(s, p)
    bent: float = (abs(rate) + SLOW) ** (p.drum_speed_slip_exponent - 1.0)
    return value * (1.0 - k * rate * bent)
