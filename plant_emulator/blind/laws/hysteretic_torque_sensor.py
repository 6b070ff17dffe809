"""The torque sensor shows a change only after the change exceeds the play of its element.

    T_meas = play of width 2 h on T

Source: M. A. Krasnoselskii, A. V. Pokrovskii, Systems with Hysteresis (1989), the play operator.
h = 0: no hysteresis.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "torque_sensor"
PARAMETERS = {
    "half_width": EffectParameter(
        neutral=0.0, lower=0.0, upper=20.0, plausible=0.7, unit="N m", meaning="h"
    ),
}


def start(p: Record) -> float:
    """Measured torque at the start of a run: 0, because the bench is at rest [N m]."""
    return 0.0


def advance(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Measured torque at the end of an implicit stage of size a [N m]."""
    half = p.hysteretic_torque_sensor_half_width
    return base if half == 0.0 else max(value - half, min(value + half, base))


MEMORIES = {"shown": Memory(start, advance, follows="measured_shaft_torque")}


def measured_shaft_torque(value: float, s: Record, p: Record) -> float:
    """Measured shaft torque [N m]."""
    return (
        value if p.hysteretic_torque_sensor_half_width == 0.0 else s.hysteretic_torque_sensor_shown
    )
