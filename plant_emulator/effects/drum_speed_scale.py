"""The measuring wheel has another radius than its evaluation assumes.

    omega_meas = (1 + e) omega_d,   1 + e = r_assumed / r_true of the wheel

Source: JCGM 200, International Vocabulary of Metrology, on the sensitivity of a measuring system; a
wheel that rolls on the drum turns by the ratio of the radii.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "speed_sensor"
EXACT = True
PARAMETERS = {
    "error": EffectParameter(
        neutral=0.0, lower=-0.3, upper=0.3, plausible=0.01, unit="1", meaning="e"
    ),
}


def measured_drum_speed(value: float, s: Record, p: Record) -> float:
    """Drum speed that the measuring wheel shows [rad/s]."""
    return value * (1.0 + p.drum_speed_scale_error)
