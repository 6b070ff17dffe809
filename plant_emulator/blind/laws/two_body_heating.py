"""The current warms the armature winding. The winding warms the iron with a delay.

    R_a = R_a0 (1 + alpha theta_w)
    C_w dtheta_w/dt = R_a i^2 - G_w (theta_w - theta_i),   C_i dtheta_i/dt = G_w (theta_w - theta_i)

Source: thermal network of two bodies, e.g. J. R. Hendershot, T. J. E. Miller, Design of Brushless
Permanent-Magnet Machines, chapter on cooling. alpha = 0: a resistance independent of temperature.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "motor"
PARAMETERS = {
    "temperature_coefficient": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.01, plausible=0.0039, unit="1/K", meaning="alpha"
    ),
    "start_rise": EffectParameter(
        neutral=30.0,
        lower=-60.0,
        upper=150.0,
        plausible=30.0,
        unit="K",
        meaning="theta at start",
        per_run=True,
    ),
    "winding_capacity": EffectParameter(
        neutral=2e3, lower=1e2, upper=1e6, plausible=2e3, unit="J/K", meaning="C_w"
    ),
    "iron_capacity": EffectParameter(
        neutral=8e3, lower=1e2, upper=1e6, plausible=8e3, unit="J/K", meaning="C_i"
    ),
    "conductance": EffectParameter(
        neutral=20.0, lower=0.0, upper=1e3, plausible=20.0, unit="W/K", meaning="G_w"
    ),
}


def start(p: Record) -> float:
    """Temperature rise of winding and iron at the start of a run [K]."""
    return p.two_body_heating_start_rise


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Temperature rise of the winding at the end of an implicit stage of size a [K]."""
    if p.two_body_heating_temperature_coefficient == 0.0:
        return base
    rate = a / p.two_body_heating_winding_capacity
    heat = s.resistance * s.armature_current * s.armature_current
    g = p.two_body_heating_conductance
    return (base + rate * (heat + g * s.two_body_heating_iron)) / (1.0 + rate * g)


def advance_iron(base: float, a: float, s: Record, p: Record) -> float:
    """Temperature rise of the iron at the end of an implicit stage of size a [K]."""
    if p.two_body_heating_temperature_coefficient == 0.0:
        return base
    rate = a * p.two_body_heating_conductance / p.two_body_heating_iron_capacity
    return (base + rate * s.two_body_heating_winding) / (1.0 + rate)


MEMORIES = {"winding": Memory(start, advance), "iron": Memory(start, advance_iron)}


def resistance(value: float, s: Record, p: Record) -> float:
    """Resistance of the warm armature [ohm]."""
    alpha = p.two_body_heating_temperature_coefficient
    return value if alpha == 0.0 else value * (1.0 + alpha * s.two_body_heating_winding)
