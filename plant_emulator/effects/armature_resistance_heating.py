"""The armature's resistance rises with the temperature of its winding.

    R_a = R_a0 (1 + alpha theta)             theta: rise above the temperature at which R_a0 holds
    C dtheta/dt = R_a i^2 - G theta          heat of the current, loss to the air

Sources: IEC 60034-1, rise of a winding by its resistance (copper: alpha = 1 / (235 + 20) per K at
20 degC); the heat balance is that of one lumped body, e.g. W. Leonhard, Control of Electrical
Drives. alpha = 0: the resistance is constant. A current controller hides this effect; the armature
voltage shows it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "motor"
NEEDS = "log armature_voltage_V: the current loop hides the resistance"
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
        std=20.0,
    ),
    "heat_capacity": EffectParameter(
        neutral=5e3, lower=1e2, upper=1e6, plausible=5e3, unit="J/K", meaning="C"
    ),
    "conductance": EffectParameter(
        neutral=8.0, lower=0.0, upper=1e3, plausible=8.0, unit="W/K", meaning="G"
    ),
}


def start(p: Record) -> float:
    """Temperature rise of the winding at the start of a run [K]."""
    return p.armature_resistance_heating_start_rise


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Temperature rise of the winding at the end of an implicit stage of size a [K]."""
    if p.armature_resistance_heating_temperature_coefficient == 0.0:
        return base
    capacity = p.armature_resistance_heating_heat_capacity
    heat = s.resistance * s.armature_current * s.armature_current
    conductance = p.armature_resistance_heating_conductance
    return (base + a / capacity * heat) / (1.0 + a * conductance / capacity)


MEMORIES = {"rise": Memory(start, advance)}


def resistance(value: float, s: Record, p: Record) -> float:
    """Resistance of the warm armature [ohm]."""
    alpha = p.armature_resistance_heating_temperature_coefficient
    if alpha == 0.0:
        return value
    return value * (1.0 + alpha * s.armature_resistance_heating_rise)
