"""The torque sensor shows too much or too little in proportion to the torque.

    T_meas = (1 + e) T

Source: JCGM 200, International Vocabulary of Metrology, on the sensitivity of a measuring system.
e is the relative error of the sensor's sensitivity.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "torque_sensor"
EXACT = True
PARAMETERS = {
    "error": EffectParameter(
        neutral=0.0, lower=-0.5, upper=0.5, plausible=0.03, unit="1", meaning="e"
    ),
}


def measured_shaft_torque(value: float, s: Record, p: Record) -> float:
    """Shaft torque that the sensor shows [N m]."""
    return value * (1.0 + p.torque_sensor_gain_error)
