"""The truck's tyre slips on the drum, and its slip grows faster than its force.

    tau dT/dt = T_w - T,   tau = c (1 + |T| / T_0) J_w |v| / r_w^2,   v = r_d omega_d

Source: H. B. Pacejka, Tyre and Vehicle Dynamics, on the bend of the slip curve. c = 0: no slip.
Needs a truck.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "wheel_contact"
PARAMETERS = {
    "slip_per_force": EffectParameter(
        neutral=0.0, lower=0.0, upper=1e-3, plausible=1e-5, unit="1/N", meaning="c"
    ),
    "wheel_inertia": EffectParameter(
        neutral=4.0, lower=0.1, upper=50.0, plausible=4.0, unit="kg m^2", meaning="J_w"
    ),
    "torque_of_double": EffectParameter(
        neutral=3000.0, lower=1.0, upper=1e5, plausible=3000.0, unit="N m", meaning="T_0"
    ),
}


def start(p: Record) -> float:
    """Torque on the drum at the start of a run: 0, because the truck stands [N m]."""
    return 0.0


def advance(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Torque on the drum at the end of an implicit stage of size a [N m]."""
    slip = p.progressive_tyre_slip_slip_per_force
    if slip == 0.0:
        return base
    slip *= 1.0 + abs(value) / p.progressive_tyre_slip_torque_of_double
    inertia = p.progressive_tyre_slip_wheel_inertia / (p.wheel_radius * p.wheel_radius)
    tau = slip * inertia * p.drum_radius * abs(s.drum_speed)
    return value + (base - value) * (tau / (tau + a))


MEMORIES = {"torque": Memory(start, advance, follows="drum_torque")}


def drum_torque(value: float, s: Record, p: Record) -> float:
    """External torque on the drum [N m]."""
    return (
        value if p.progressive_tyre_slip_slip_per_force == 0.0 else s.progressive_tyre_slip_torque
    )
