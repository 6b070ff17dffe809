"""The torque sensor follows the shaft's torque as a first-order lag.

    tau dT_s/dt = T_meas - T_s

Source: first-order response of a measuring chain, e.g. K. Ogata, Modern Control Engineering,
chapter on first-order systems. At tau = 0 the sensor shows the torque itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.kernel_types import Record

SUBSYSTEM = "torque_sensor"
PARAMETERS = {
    "time_constant": EffectParameter(
        neutral=0.0, lower=0.0, upper=1.0, plausible=0.05, unit="s", meaning="tau"
    ),
}


def start(p: Record) -> float:
    """The bench starts at rest, without torque [N m]."""
    return 0.0


def advance(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Shown torque at the end of an implicit stage of size a [N m]; at tau = 0 of no use."""
    tau = p.torque_sensor_lag_time_constant
    if tau == 0.0:
        return base
    return value + (base - value) * (tau / (tau + a))


MEMORIES = {"shown": Memory(start, advance, follows="measured_shaft_torque")}


def measured_shaft_torque(value: float, s: Record, p: Record) -> float:
    """What the sensor shows [N m]."""
    if p.torque_sensor_lag_time_constant == 0.0:
        return value
    return s.torque_sensor_lag_shown
