"""The zero of the torque sensor creeps at a falling rate.

    T_meas = T + r tau ln(1 + t / tau)

Sources: JCGM 200, International Vocabulary of Metrology, 4.21 (instrumental drift); I. M. Ward,
Mechanical Properties of Solid Polymers, on the logarithmic creep of loaded polymers, here the glue
under a strain gauge. r: rate at the start of the run. r = 0: no drift.
"""

from __future__ import annotations

from math import log
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "torque_sensor"
PARAMETERS = {
    "first_rate": EffectParameter(
        neutral=0.0, lower=-1.0, upper=1.0, plausible=0.03, unit="N m/s", meaning="r"
    ),
    "slowing_time": EffectParameter(
        neutral=40.0, lower=1.0, upper=1e4, plausible=40.0, unit="s", meaning="tau"
    ),
}


def measured_shaft_torque(value: float, s: Record, p: Record) -> float:
    """Measured shaft torque [N m]."""
    tau = p.creeping_torque_drift_slowing_time
    return value + p.creeping_torque_drift_first_rate * tau * log(1.0 + s.time / tau)
