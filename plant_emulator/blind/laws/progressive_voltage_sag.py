"""The available armature voltage falls under load, with a lag and faster than the load grows.

    |u_a| <= u_max - U_s,   tau dU_s/dt = R_s |i| (1 + r |i| / i_max) - U_s

Sources: J. Schaefer, Rectifier Circuits: Theory and Design: the voltage falls faster where
commutations overlap; W. Leonhard, Control of Electrical Drives, on the transient of a supply with
resistance and inductance. R_s = 0: a stiff supply.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
PARAMETERS = {
    "source_resistance": EffectParameter(
        neutral=0.0, lower=0.0, upper=4.0, plausible=1.2, unit="ohm", meaning="R_s"
    ),
    "time_constant": EffectParameter(
        neutral=0.05, lower=0.001, upper=1.0, plausible=0.05, unit="s", meaning="tau"
    ),
    "rise": EffectParameter(
        neutral=0.3, lower=0.0, upper=1.0, plausible=0.3, unit="1", meaning="r"
    ),
}


def start(p: Record) -> float:
    """Voltage sag at the start of a run: 0, because no current flows [V]."""
    return 0.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Voltage sag at the end of an implicit stage of size a [V]."""
    if p.progressive_voltage_sag_source_resistance == 0.0:
        return base
    tau, current = p.progressive_voltage_sag_time_constant, abs(s.armature_current)
    steeper = 1.0 + p.progressive_voltage_sag_rise * current / p.armature_current_limit
    drop = p.progressive_voltage_sag_source_resistance * current * steeper
    return drop + (base - drop) * (tau / (tau + a))


MEMORIES = {"sag": Memory(start, advance)}


def voltage_limit(value: float, s: Record, p: Record) -> float:
    """Available armature voltage [V]."""
    if p.progressive_voltage_sag_source_resistance == 0.0:
        return value
    return max(0.0, value - s.progressive_voltage_sag_sag)
