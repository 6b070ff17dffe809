"""The zero of the torque sensor drifts away during the run.

    T_meas = T + r t

Source: JCGM 200, International Vocabulary of Metrology, on instrumental drift. t is the time
since the start of the run: the sensor was set to zero there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.kernel_types import Record

SUBSYSTEM = "torque_sensor"
PARAMETERS = {
    "rate": EffectParameter(
        neutral=0.0, lower=-1.0, upper=1.0, plausible=0.02, unit="N m/s", meaning="r"
    ),
}


def measured_shaft_torque(value: float, s: Record, p: Record) -> float:
    """What the sensor shows [N m]."""
    return value + p.torque_sensor_drift_rate * s.time
