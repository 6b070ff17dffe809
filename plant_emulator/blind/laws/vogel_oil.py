"""The gear's viscous friction follows Vogel's viscosity of the oil, which the losses warm.

    f_g(T) = f_g exp(B (1 / (T - T_V) - 1 / (T_n - T_V))),   B = beta (T_n - T_V)^2
    C dT/dt = T_f omega_g - G (T - T_shell)

Sources: H. Vogel, Physikalische Zeitschrift 22 (1921) 645, on the viscosity of oils; ISO/TR 14179-1
for the lumped heat balance of a gearbox. beta: relative slope at T_n. beta = 0: friction
independent of temperature.
"""

from __future__ import annotations

from math import exp
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "gear"
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
    ),
    "shell_temperature": EffectParameter(
        neutral=305.15,
        lower=253.15,
        upper=373.15,
        plausible=293.15,
        unit="K",
        meaning="T_shell",
        per_run=True,
    ),
    "nominal_temperature": EffectParameter(
        neutral=313.15, lower=273.15, upper=373.15, plausible=313.15, unit="K", meaning="T_n"
    ),
    "solid_below": EffectParameter(
        neutral=135.0, lower=60.0, upper=200.0, plausible=135.0, unit="K", meaning="T_n - T_V"
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
    return p.vogel_oil_start_temperature


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Temperature of the oil at the end of an implicit stage of size a [K]."""
    rate, g = a / p.vogel_oil_heat_capacity, p.vogel_oil_shell_conductance
    heat = s.gear_friction_torque * s.gear_speed + g * p.vogel_oil_shell_temperature
    return (base + rate * heat) / (1.0 + rate * g)


MEMORIES = {"oil": Memory(start, advance)}


def gear_viscous_friction(value: float, s: Record, p: Record) -> float:
    """Coefficient of the viscous friction at the oil's temperature [N m (s/rad)^delta_g]."""
    beta = p.vogel_oil_viscosity_coefficient
    if beta == 0.0:
        return value
    reach = p.vogel_oil_solid_below
    warm = max(1.0, reach + s.vogel_oil_oil - p.vogel_oil_nominal_temperature)
    return value * exp(beta * reach * reach * (1.0 / warm - 1.0 / reach))


def shell_temperature(value: float, s: Record, p: Record) -> float:
    """Measured shell temperature [K]."""
    return value if p.vogel_oil_viscosity_coefficient == 0.0 else p.vogel_oil_shell_temperature
