"""Friction of the gear varies with its output angle: the output is neither centred nor round.

    factor = 1 + a (cos(theta_g + phi) + v cos 2 (theta_g + phi))

Source: M. R. Popovic, A. A. Goldenberg, IEEE Trans. Robotics and Automation 14 (1998) 114, friction
as a Fourier series in the angle. a = 0: a true gear.
"""

from __future__ import annotations

from math import cos
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "gear"
PARAMETERS = {
    "amplitude": EffectParameter(
        neutral=0.0, lower=-0.9, upper=0.9, plausible=0.05, unit="1", meaning="a"
    ),
    "phase": EffectParameter(
        neutral=0.0, lower=-6.3, upper=6.3, plausible=0.0, unit="rad", meaning="phi", per_run=True
    ),
    "second": EffectParameter(
        neutral=0.2, lower=0.0, upper=1.0, plausible=0.2, unit="1", meaning="v"
    ),
}


def start(p: Record) -> float:
    """Angle of the gear output at the start of a run: its zero [rad]."""
    return 0.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Angle of the gear output at the end of an implicit stage of size a [rad]."""
    return base + a * s.gear_speed


MEMORIES = {"angle": Memory(start, advance)}


def gear_direction_factor(value: float, s: Record, p: Record) -> float:
    """Friction at the gear output's angle divided by the nominal friction [1]."""
    amplitude = p.runout_two_harmonics_amplitude
    if amplitude == 0.0:
        return value
    angle = s.runout_two_harmonics_angle + p.runout_two_harmonics_phase
    return value * (
        1.0 + amplitude * (cos(angle) + p.runout_two_harmonics_second * cos(2.0 * angle))
    )
