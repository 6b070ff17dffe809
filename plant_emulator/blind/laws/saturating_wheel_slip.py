"""The measuring wheel slips in proportion to the drum's acceleration, up to a limit.

    omega_meas = (1 - s_m tanh(k omega_d' / s_m)) omega_d

Source: H. B. Pacejka, Tyre and Vehicle Dynamics: the slip is proportional to a small force, then
saturates. k = 0: no slip.
"""

from __future__ import annotations

from math import tanh
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "speed_sensor"
PARAMETERS = {
    "slip_per_acceleration": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.2, plausible=0.01, unit="s^2/rad", meaning="k"
    ),
    "bend": EffectParameter(
        neutral=0.03, lower=0.001, upper=1.0, plausible=0.03, unit="1", meaning="s_m"
    ),
}


def measured_drum_speed(value: float, s: Record, p: Record) -> float:
    """Measured drum speed [rad/s]."""
    k = p.saturating_wheel_slip_slip_per_acceleration
    if k == 0.0:
        return value
    friction = s.drum_viscous_friction * s.drum_speed
    if s.drum_speed != 0.0:
        friction += s.drum_coulomb_friction if s.drum_speed > 0.0 else -s.drum_coulomb_friction
    rate = (s.drum_shaft_torque + s.drum_torque - friction) / p.drum_inertia
    return value * (
        1.0 - p.saturating_wheel_slip_bend * tanh(k * rate / p.saturating_wheel_slip_bend)
    )
