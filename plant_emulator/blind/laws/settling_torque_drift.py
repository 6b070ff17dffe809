"""The zero of the torque sensor drifts while the sensor warms, and settles.

    T_meas = T + r tau (1 - exp(-t / tau))

Source: JCGM 200, International Vocabulary of Metrology, 4.21 (instrumental drift), of a body that
warms by one time constant. r is the rate at the start of the run. r = 0: no drift.
"""

from __future__ import annotations

from math import exp
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.kernel_types import Record

SUBSYSTEM = "torque_sensor"
PARAMETERS = {
    "first_rate": EffectParameter(
        neutral=0.0, lower=-1.0, upper=1.0, plausible=0.03, unit="N m/s", meaning="r"
    ),
    "time_constant": EffectParameter(
        neutral=60.0, lower=1.0, upper=1e4, plausible=60.0, unit="s", meaning="tau"
    ),
}


def measured_shaft_torque(value: float, s: Record, p: Record) -> float:
    """What the sensor shows [N m]."""
    tau = p.settling_torque_drift_time_constant
    return value + p.settling_torque_drift_first_rate * tau * (1.0 - exp(-s.time / tau))
