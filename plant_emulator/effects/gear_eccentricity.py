"""Friction of the gear swings once per revolution of its output, which runs out of true.

    T_f(theta_g, omega_g) = (1 + a cos(theta_g + phi)) (f_gc + f_g |omega_g|^delta_g) sgn omega_g

Source: M. R. Popovic, A. A. Goldenberg, IEEE Trans. Robotics and Automation 14 (1998) 114, friction
as a Fourier series in the angle, here its first harmonic; B. Armstrong, Proc. IEEE Int. Conf.
Robotics and Automation (1988) 1422, measured it on geared joints. theta_g is the angle since the
start of the run. phi is the angle at the start; it is unknown and belongs to one run.
"""

from __future__ import annotations

from math import cos, pi
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "gear"
# a < 0 equals a phase of half a turn more, so that a fit may start on the wrong side. The phase may
# leave [-pi, pi] for the same reason. Its std is that of an angle anywhere on the circle.
PARAMETERS = {
    "amplitude": EffectParameter(
        neutral=0.0, lower=-0.9, upper=0.9, plausible=0.05, unit="1", meaning="a"
    ),
    "phase": EffectParameter(
        neutral=0.0,
        lower=-2.0 * pi,
        upper=2.0 * pi,
        plausible=0.0,
        unit="rad",
        meaning="phi",
        per_run=True,
        std=pi / 3.0**0.5,
    ),
}


def start(p: Record) -> float:
    """Angle of the gear output at the start of a run, counted from there [rad]."""
    return 0.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Angle of the gear output at the end of an implicit stage of size a [rad]."""
    return base + a * s.gear_speed


MEMORIES = {"angle": Memory(start, advance)}


def gear_direction_factor(value: float, s: Record, p: Record) -> float:
    """Factor on the friction of the table at the angle of the gear output [1]."""
    amplitude = p.gear_eccentricity_amplitude
    if amplitude == 0.0:
        return value
    return value * (1.0 + amplitude * cos(s.gear_eccentricity_angle + p.gear_eccentricity_phase))
