"""The zero of the torque sensor drifts away during the run.

    T_meas = T + r (1 - exp(-lambda t)) / lambda,   r t at lambda = 0

Source: JCGM 200, International Vocabulary of Metrology, on instrumental drift. lambda > 0 describes
a sensor that warms up and settles. t is the time since the start of the run, where the sensor was
set to zero.
"""

from __future__ import annotations

from math import expm1
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "torque_sensor"
PARAMETERS = {
    "rate": EffectParameter(
        neutral=0.0, lower=-1.0, upper=1.0, plausible=0.02, unit="N m/s", meaning="r"
    ),
    "settling": EffectParameter(
        neutral=0.0, lower=-0.02, upper=0.2, plausible=0.0, unit="1/s", meaning="lambda", std=0.01
    ),
}


def measured_shaft_torque(value: float, s: Record, p: Record) -> float:
    """Shaft torque that the sensor shows [N m]."""
    settling = p.torque_sensor_drift_settling
    lasting = s.time if settling == 0.0 else -expm1(-settling * s.time) / settling
    return value + p.torque_sensor_drift_rate * lasting
