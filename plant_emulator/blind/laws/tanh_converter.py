"""A thyristor bridge drops voltage, pauses at current reversal, and ripples with the mains.

    u_a = u - U tanh(i / i_g)
    i = 0 for t_0 where it would change sign
    i_meas = i + I cos(6 psi + phi) tanh^2(i / i_g)
    psi = 2 pi f t + (D / f_s) sin(2 pi f_s t)        the mains: f(t) = f + D cos(2 pi f_s t)

Sources: W. Leonhard, Control of Electrical Drives, chapter on line-commutated converters;
J. J. Slotine, W. Li, Applied Nonlinear Control (tanh instead of a sign). The mains frequency is not
exactly 50 Hz, and it swings: P. Kundur, Power System Stability and Control, chapter on small-signal
stability (inter-area modes, 0.1 to 0.7 Hz). U, t_0, I = 0: an ideal converter.
"""

from __future__ import annotations

from math import cos, pi, sin, tanh
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
PARAMETERS = {
    "pause": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.1, plausible=0.0066, unit="s", meaning="t_0"
    ),
    "drop": EffectParameter(
        neutral=0.0, lower=0.0, upper=50.0, plausible=6.0, unit="V", meaning="U"
    ),
    "ripple": EffectParameter(
        neutral=0.0, lower=0.0, upper=10.0, plausible=0.5, unit="A", meaning="I"
    ),
    "discontinuous_below": EffectParameter(
        neutral=2.0, lower=0.5, upper=20.0, plausible=2.0, unit="A", meaning="i_g"
    ),
    "mains": EffectParameter(
        neutral=50.02, lower=49.8, upper=50.2, plausible=50.02, unit="Hz", meaning="f", per_run=True
    ),
    "phase": EffectParameter(
        neutral=0.0, lower=-6.3, upper=6.3, plausible=0.0, unit="rad", meaning="phi", per_run=True
    ),
    "swing": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.1, plausible=0.005, unit="Hz", meaning="D"
    ),
}

# Frequency of the swing [Hz].
SWINGING = 0.25
# Resistance of blocked thyristors [ohm].
OPEN = 1e5


def sense(s: Record) -> float:
    """Sign of the current [1]."""
    if s.armature_current == 0.0:
        return 0.0
    return 1.0 if s.armature_current > 0.0 else -1.0


def start(p: Record) -> float:
    """Readiness of the bridge at the start of a run: ready for forward current [1]."""
    return 1.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Readiness of the bridge at the end of an implicit stage of size a [1].

    It moves from -1 (ready for backward current) to 1 (forward) in one pause.
    """
    pause = p.tanh_converter_pause
    return base if pause == 0.0 else max(-1.0, min(1.0, base + 2.0 * a / pause * sense(s)))


MEMORIES = {"ready": Memory(start, advance)}


def resistance(value: float, s: Record, p: Record) -> float:
    """Resistance of the armature circuit; huge during the pause [ohm]."""
    sign = sense(s)
    blocked = p.tanh_converter_pause > 0.0 and sign != 0.0 and s.tanh_converter_ready * sign < 1.0
    return OPEN if blocked else value


def converter_voltage_drop(value: float, s: Record, p: Record) -> float:
    """Voltage drop of the converter [V]."""
    if p.tanh_converter_drop == 0.0:
        return value
    return value + p.tanh_converter_drop * tanh(
        s.armature_current / p.tanh_converter_discontinuous_below
    )


def measured_armature_current(value: float, s: Record, p: Record) -> float:
    """Measured armature current with its ripple [A]."""
    if p.tanh_converter_ripple == 0.0:
        return value
    share = tanh(s.armature_current / p.tanh_converter_discontinuous_below)
    mains = 2.0 * pi * p.tanh_converter_mains * s.time
    mains += p.tanh_converter_swing / SWINGING * sin(2.0 * pi * SWINGING * s.time)
    wave = cos(6.0 * mains + p.tanh_converter_phase)
    return value + p.tanh_converter_ripple * wave * share * share
