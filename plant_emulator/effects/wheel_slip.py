"""The truck's tyre slips on the drum, and its torque reaches the drum later.

    tau dT/dt = T_w - T,   tau = c J_w |v| / r_w^2,   v = r_d omega_d

Source: H. B. Pacejka, Tyre and Vehicle Dynamics, on longitudinal slip: small slip is proportional
to the force, kappa = c F. The wheel has the inertia J_w, the truck's drive included. It first has
to reach the speed v (1 + kappa) / r_w, and the torque that this takes is missing at the drum. T_w
is the torque of a wheel without slip. c = 0: no slip. The effect exists only with a truck.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "wheel_contact"
NEEDS = "a run with a truck on the drum"
PARAMETERS = {
    "slip_per_force": EffectParameter(
        neutral=0.0, lower=0.0, upper=1e-3, plausible=1e-5, unit="1/N", meaning="c"
    ),
    "wheel_inertia": EffectParameter(
        neutral=4.0, lower=0.1, upper=50.0, plausible=4.0, unit="kg m^2", meaning="J_w"
    ),
}


def start(p: Record) -> float:
    """The truck stands at the start [N m]."""
    return 0.0


def advance(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Torque on the drum at the end of an implicit stage of size a [N m]."""
    if p.wheel_slip_slip_per_force == 0.0:
        return base
    speed = p.drum_radius * abs(s.drum_speed)
    inertia = p.wheel_slip_wheel_inertia / (p.wheel_radius * p.wheel_radius)
    tau = p.wheel_slip_slip_per_force * inertia * speed
    return value + (base - value) * (tau / (tau + a))


MEMORIES = {"torque": Memory(start, advance, follows="drum_torque")}


def drum_torque(value: float, s: Record, p: Record) -> float:
    """Torque of the truck on the drum, delayed by the slip [N m]."""
    if p.wheel_slip_slip_per_force == 0.0:
        return value
    return s.wheel_slip_torque
