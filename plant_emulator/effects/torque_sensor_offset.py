"""The torque sensor shows a torque where there is none.

    T_meas = T + T_0

Source: JCGM 200, International Vocabulary of Metrology, on instrumental bias and zero error. T_0 is
the same at every torque and time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "torque_sensor"
EXACT = True
PARAMETERS = {
    "offset": EffectParameter(
        neutral=0.0, lower=-20.0, upper=20.0, plausible=0.5, unit="N m", meaning="T_0"
    ),
}


def measured_shaft_torque(value: float, s: Record, p: Record) -> float:
    """Shaft torque that the sensor shows [N m]."""
    return value + p.torque_sensor_offset_offset
