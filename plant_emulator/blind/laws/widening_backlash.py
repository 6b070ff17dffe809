"""The backlash width changes during the run, because teeth and housing warm unequally.

    alpha(t) = alpha (1 + r t)

Source: G. Niemann, H. Winter, Maschinenelemente, vol. 2, on backlash and temperature. r = 0: a
constant backlash width.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "backlash_shaft"
PARAMETERS = {
    "rate": EffectParameter(
        neutral=0.0, lower=-0.01, upper=0.01, plausible=3e-3, unit="1/s", meaning="r"
    ),
}


def backlash_half_gap(value: float, s: Record, p: Record) -> float:
    """Half of the backlash width at the current time [rad]."""
    return value * (1.0 + p.widening_backlash_rate * s.time)
