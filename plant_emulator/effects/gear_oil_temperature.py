"""The gear's viscous friction follows its oil, which its own losses warm.

    f_g(T) = f_g exp(-beta (T - T_n))             fall of the viscosity with temperature (Reynolds)
    C dT/dt = T_f omega_g - G (T - T_shell)       heat of the friction, loss through the shell

Sources: O. Reynolds, Phil. Trans. R. Soc. 177 (1886) 157 for the exponential viscosity; the heat
balance is the lumped balance of a gearbox (ISO/TR 14179-1). T is the temperature of the oil. The
nominal friction holds at T_n. The shell keeps T_shell during a run, since it lags by minutes.
beta = 0: the friction does not depend on the temperature.
"""

from __future__ import annotations

from math import exp
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "gear"
NEEDS = "a cold start, and a run of some minutes"
PARAMETERS = {
    "viscosity_coefficient": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.1, plausible=0.02, unit="1/K", meaning="beta"
    ),
    "start_temperature": EffectParameter(
        neutral=305.15,
        lower=253.15,
        upper=393.15,
        plausible=293.15,
        unit="K",
        meaning="T at start",
        per_run=True,
        std=15.0,
    ),
    "nominal_temperature": EffectParameter(
        neutral=313.15, lower=273.15, upper=373.15, plausible=313.15, unit="K", meaning="T_n"
    ),
    "shell_temperature": EffectParameter(
        neutral=305.15,
        lower=253.15,
        upper=373.15,
        plausible=293.15,
        unit="K",
        meaning="T_shell",
        per_run=True,
        measured="shell_temperature",
    ),
    "heat_capacity": EffectParameter(
        neutral=1e5, lower=1e3, upper=1e7, plausible=1e5, unit="J/K", meaning="C"
    ),
    "shell_conductance": EffectParameter(
        neutral=100.0, lower=0.0, upper=1e4, plausible=100.0, unit="W/K", meaning="G"
    ),
}


def start(p: Record) -> float:
    """Temperature of the oil at the start of a run [K]."""
    return p.gear_oil_temperature_start_temperature


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Temperature of the oil at the end of an implicit stage of size a [K]."""
    heat = s.gear_friction_torque * s.gear_speed
    conductance = p.gear_oil_temperature_shell_conductance
    capacity = p.gear_oil_temperature_heat_capacity
    cooled = base + a / capacity * (heat + conductance * p.gear_oil_temperature_shell_temperature)
    return cooled / (1.0 + a * conductance / capacity)


MEMORIES = {"oil": Memory(start, advance)}


def gear_viscous_friction(value: float, s: Record, p: Record) -> float:
    """Coefficient of the viscous friction at the temperature of the oil [N m (s/rad)^delta_g]."""
    beta = p.gear_oil_temperature_viscosity_coefficient
    if beta == 0.0:
        return value
    warmer = s.gear_oil_temperature_oil - p.gear_oil_temperature_nominal_temperature
    return value * exp(-beta * warmer)


def shell_temperature(value: float, s: Record, p: Record) -> float:
    """Shell temperature that the thermocouples show [K]."""
    if p.gear_oil_temperature_viscosity_coefficient == 0.0:
        return value
    return p.gear_oil_temperature_shell_temperature
