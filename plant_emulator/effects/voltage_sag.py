"""The available armature voltage falls under load.

    |u_a| <= u_max - U_s,   tau dU_s/dt = R_s i_max (|i| / i_max)^n - U_s

Sources: N. Mohan, T. M. Undeland, W. P. Robbins, Power Electronics, chapter on line-frequency
controlled rectifiers: commutation and supply let their direct voltage fall in proportion to the
current, by R_s (n = 1), and faster where the commutations of two pairs of valves overlap (n > 1);
W. Leonhard, Control of Electrical Drives, chapter on line-commutated converters: the supply's
inductance delays the fall by tau. tau = 0: the voltage falls at once. i_max is the drive's nominal
current limit, at which all n give the same fall.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
NEEDS = "a run above base speed up to the voltage limit"
PARAMETERS = {
    "source_resistance": EffectParameter(
        neutral=0.0, lower=0.0, upper=4.0, plausible=1.5, unit="ohm", meaning="R_s"
    ),
    "time_constant": EffectParameter(
        neutral=0.0, lower=0.0, upper=1.0, plausible=0.0, unit="s", meaning="tau", std=0.05
    ),
    "exponent": EffectParameter(
        neutral=1.0, lower=0.5, upper=3.0, plausible=1.0, unit="1", meaning="n", std=0.5
    ),
}


def start(p: Record) -> float:
    """The bench starts without current [V]."""
    return 0.0


def drop(s: Record, p: Record) -> float:
    """Sag under a constant current [V]."""
    current = abs(s.armature_current) / p.armature_current_limit
    fall: float = current**p.voltage_sag_exponent
    return p.voltage_sag_source_resistance * p.armature_current_limit * fall


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Sag at the end of an implicit stage of size a [V]; not used at tau = 0."""
    tau = p.voltage_sag_time_constant
    if tau == 0.0:
        return base
    lasting = drop(s, p)
    return lasting + (base - lasting) * (tau / (tau + a))


MEMORIES = {"sag": Memory(start, advance)}


def voltage_limit(value: float, s: Record, p: Record) -> float:
    """Largest armature voltage [V]."""
    if p.voltage_sag_source_resistance == 0.0:
        return value
    sag = drop(s, p) if p.voltage_sag_time_constant == 0.0 else s.voltage_sag_sag
    return max(0.0, value - sag)
