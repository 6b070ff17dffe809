"""The drum's speed is shown through a first-order filter.

    tau domega_s/dt = omega_d - omega_s

Source: first-order response of a measuring chain, e.g. K. Ogata, Modern Control Engineering,
chapter on first-order systems. At tau = 0 the drum's own speed is shown.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "speed_sensor"
PARAMETERS = {
    "time_constant": EffectParameter(
        neutral=0.0, lower=0.0, upper=1.0, plausible=0.05, unit="s", meaning="tau"
    ),
}


def start(p: Record) -> float:
    """The bench starts at rest [rad/s]."""
    return 0.0


def advance(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Shown speed at the end of an implicit stage of size a [rad/s]."""
    tau = p.drum_speed_lag_time_constant
    if tau == 0.0:
        return base
    return value + (base - value) * (tau / (tau + a))


MEMORIES = {"shown": Memory(start, advance, follows="measured_drum_speed")}


def measured_drum_speed(value: float, s: Record, p: Record) -> float:
    """Drum speed that is shown [rad/s]."""
    if p.drum_speed_lag_time_constant == 0.0:
        return value
    return s.drum_speed_lag_shown
