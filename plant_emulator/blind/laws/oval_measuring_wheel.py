"""The measuring wheel is not round, so the measured drum speed ripples with the wheel's turns.

    omega_meas = omega_d (1 + a cos(n theta_d + phi)),   n = drum radius / wheel radius

Source: JCGM 200, International Vocabulary of Metrology, on influence quantities. A wheel that rolls
on the drum turns n times as fast. a = 0: a round wheel.
"""

from __future__ import annotations

from math import cos
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "speed_sensor"
PARAMETERS = {
    "amplitude": EffectParameter(
        neutral=0.0, lower=-0.2, upper=0.2, plausible=0.01, unit="1", meaning="a"
    ),
    "ratio": EffectParameter(
        neutral=6.45, lower=1.0, upper=30.0, plausible=6.45, unit="1", meaning="n"
    ),
    "phase": EffectParameter(
        neutral=0.0, lower=-6.3, upper=6.3, plausible=0.0, unit="rad", meaning="phi", per_run=True
    ),
}


def start(p: Record) -> float:
    """Angle of the drum at the start of a run: its zero [rad]."""
    return 0.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Angle of the drum at the end of an implicit stage of size a [rad]."""
    return base + a * s.drum_speed


MEMORIES = {"angle": Memory(start, advance)}


def measured_drum_speed(value: float, s: Record, p: Record) -> float:
    """Measured drum speed [rad/s]."""
    amplitude = p.oval_measuring_wheel_amplitude
    if amplitude == 0.0:
        return value
    wave = cos(
        p.oval_measuring_wheel_ratio * s.oval_measuring_wheel_angle + p.oval_measuring_wheel_phase
    )
    return value * (1.0 + amplitude * wave)
