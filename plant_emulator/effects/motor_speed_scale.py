"""The motor's tachometer shows too much or too little; drive and log both read it.

    omega_read = (1 + e) omega_m

Source: JCGM 200, International Vocabulary of Metrology, on the sensitivity of a measuring system.
The speed controller holds the speed that it reads at the reference. A larger e makes the motor turn
more slowly.
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


def tachometer_gain(value: float, s: Record, p: Record) -> float:
    """Ratio of the measured to the true motor speed [1]."""
    return value * (1.0 + p.motor_speed_scale_error)
