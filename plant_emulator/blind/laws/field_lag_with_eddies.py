"""One part of a field change acts at once. Eddy currents in the poles delay the other part.

    k Phi = e (k Phi)_0(omega_m) + (1 - e) phi,   tau dphi/dt = (k Phi)_0 - phi

Source: W. Leonhard, Control of Electrical Drives, chapter on the separately excited DC machine in
the field-weakening range (solid poles). tau = 0: the flux follows at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "motor"
PARAMETERS = {
    "time_constant": EffectParameter(
        neutral=0.0, lower=0.0, upper=2.0, plausible=0.1, unit="s", meaning="tau"
    ),
    "at_once": EffectParameter(
        neutral=0.15, lower=0.0, upper=1.0, plausible=0.15, unit="1", meaning="e"
    ),
}


def start(p: Record) -> float:
    """Flux at the start of a run: the full field, because the bench is at rest [N m/A]."""
    return min(p.flux_constant, p.flux_constant_1 / p.flux_constant_2)


def advance(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Delayed part of the flux at the end of an implicit stage of size a [N m/A]."""
    tau = p.field_lag_with_eddies_time_constant
    return base if tau == 0.0 else value + (base - value) * (tau / (tau + a))


MEMORIES = {"late": Memory(start, advance, follows="flux")}


def flux(value: float, s: Record, p: Record) -> float:
    """Effective flux [N m/A]."""
    if p.field_lag_with_eddies_time_constant == 0.0:
        return value
    at_once = p.field_lag_with_eddies_at_once
    return at_once * value + (1.0 - at_once) * s.field_lag_with_eddies_late
