"""The field follows a change of speed late, since the field winding has an inductance.

    tau d(k Phi)/dt = (k Phi)_0(omega_m) - k Phi

Source: W. Leonhard, Control of Electrical Drives, chapter on the separately excited DC machine in
the field-weakening range. (k Phi)_0 is the flux that the field regulator demands at the speed. At
tau = 0 the flux is (k Phi)_0.
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
}


def start(p: Record) -> float:
    """The bench starts at rest, with the full field [N m/A]."""
    return min(p.flux_constant, p.flux_constant_1 / p.flux_constant_2)


def advance(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Flux at the end of an implicit stage of size a [N m/A]."""
    tau = p.field_lag_time_constant
    if tau == 0.0:
        return base
    return value + (base - value) * (tau / (tau + a))


MEMORIES = {"flux": Memory(start, advance, follows="flux")}


def flux(value: float, s: Record, p: Record) -> float:
    """Flux behind the lag of the field [N m/A]."""
    if p.field_lag_time_constant == 0.0:
        return value
    return s.field_lag_flux
