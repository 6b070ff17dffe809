"""The drum's centre of mass lies off its axis, and its weight turns the drum.

    T_d = ... - M sin theta_d,   M = m g e

Source: ISO 1940-1 / ISO 21940-11 (imbalance U = m e of a rotor). theta_d = 0 where the centre of
mass is lowest. At the start of a run theta_d is `start_angle`.
"""

from __future__ import annotations

from math import pi, sin
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drum"
# The angle may leave [-pi, pi], so that a fit that begins on the wrong side can go on past half a
# turn. Its std is that of an angle anywhere on the circle.
PARAMETERS = {
    "moment": EffectParameter(
        neutral=0.0, lower=0.0, upper=200.0, plausible=10.0, unit="N m", meaning="M"
    ),
    "start_angle": EffectParameter(
        neutral=0.0,
        lower=-2.0 * pi,
        upper=2.0 * pi,
        plausible=0.0,
        unit="rad",
        meaning="theta_d at start",
        per_run=True,
        std=pi / 3.0**0.5,
    ),
}


def start(p: Record) -> float:
    """Angle of the drum at the start of a run [rad]."""
    return p.drum_imbalance_start_angle


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Angle of the drum at the end of an implicit stage of size a [rad]."""
    if p.drum_imbalance_moment == 0.0:
        return base
    return base + a * s.drum_speed


MEMORIES = {"angle": Memory(start, advance)}


def drum_torque(value: float, s: Record, p: Record) -> float:
    """Torque on the drum, its own weight included [N m]."""
    if p.drum_imbalance_moment == 0.0:
        return value
    return value - p.drum_imbalance_moment * sin(s.drum_imbalance_angle)
