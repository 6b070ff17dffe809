"""The available armature voltage falls under load, as late as the supply's inductance lets it.

    |u_a| <= u_max - U_s,   tau dU_s/dt = R_s |i| - U_s

Source: W. Leonhard, Control of Electrical Drives, chapter on line-commutated converters, with the
transient of a supply of resistance and inductance. R_s = 0: a stiff supply.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.kernel_types import Record

SUBSYSTEM = "drive"
PARAMETERS = {
    "source_resistance": EffectParameter(
        neutral=0.0, lower=0.0, upper=4.0, plausible=1.5, unit="ohm", meaning="R_s"
    ),
    "time_constant": EffectParameter(
        neutral=0.05, lower=0.001, upper=1.0, plausible=0.05, unit="s", meaning="tau"
    ),
}


def start(p: Record) -> float:
    """The bench starts without current [V]."""
    return 0.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Sag at the end of an implicit stage of size a [V]."""
    if p.lagging_voltage_sag_source_resistance == 0.0:
        return base
    tau = p.lagging_voltage_sag_time_constant
    drop = p.lagging_voltage_sag_source_resistance * abs(s.armature_current)
    return drop + (base - drop) * (tau / (tau + a))


MEMORIES = {"sag": Memory(start, advance)}


def voltage_limit(value: float, s: Record, p: Record) -> float:
    """Largest armature voltage [V]."""
    if p.lagging_voltage_sag_source_resistance == 0.0:
        return value
    return max(0.0, value - s.lagging_voltage_sag_sag)
