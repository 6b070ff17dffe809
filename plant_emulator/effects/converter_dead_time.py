"""Two thyristor bridges feed the armature: a pause at reversal, a voltage drop, ripple.

    i = 0    for t_0 where it would change sign: the other bridge waits until this one is off
    u_a = u - U i / (|i| + i_g)       drop, steep below i_g where the current is discontinuous
    i_meas = i + I cos(2 pi 6 f t + phi) |i| / (|i| + i_g)           six pulses a mains period

Sources: W. Leonhard, Control of Electrical Drives, chapter on line-commutated converters (interval
without torque at reversal, discontinuous current); N. Mohan, T. M. Undeland, W. P. Robbins, Power
Electronics. Speeds and torque do not follow the ripple; a log of 100 Hz shows it as an alias. The
mains frequency f leaves 50 Hz by some 0.03 Hz (Regulation (EU) 2017/1485, annex III: a standard
range of 50 mHz). The alias is therefore a beat of up to some 0.3 Hz. f, and the phase phi at the
start, are unknown and belong to one run each.
"""

from __future__ import annotations

from math import cos, pi
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
NEEDS = "log armature_voltage_V as the drive asks for it: the current loop hides what is lost"
# The current is steep after a reversal: pauses 1 ms apart lie in different basins of a fit.
PARAMETERS = {
    "pause": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.1, plausible=0.0066, unit="s", meaning="t_0", step=0.0005
    ),
    "drop": EffectParameter(
        neutral=0.0, lower=0.0, upper=50.0, plausible=6.0, unit="V", meaning="U"
    ),
    "discontinuous_below": EffectParameter(
        neutral=2.0, lower=0.5, upper=20.0, plausible=2.0, unit="A", meaning="i_g"
    ),
    "ripple": EffectParameter(
        neutral=0.0, lower=0.0, upper=10.0, plausible=0.5, unit="A", meaning="I"
    ),
    # A run of 50 s tells frequencies apart that differ by 3 mHz. A fit converges from half of that.
    "mains": EffectParameter(
        neutral=50.0,
        lower=49.8,
        upper=50.2,
        plausible=50.0,
        unit="Hz",
        meaning="f",
        per_run=True,
        std=0.03,
        step=0.0025,
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
PULSES = 6.0
# Resistance of blocked thyristors [ohm].
OPEN = 1e6


def start(p: Record) -> float:
    """1: the bridge for driving forwards is ready at the start [1]."""
    return 1.0


def sense(s: Record) -> float:
    """Sign of the current, or of the leakage current during a pause [1]."""
    if s.armature_current == 0.0:
        return 0.0
    return 1.0 if s.armature_current > 0.0 else -1.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """State of the bridges at the end of an implicit stage of size a [1].

    1 or -1: the bridge for this sign of the current is ready. Values between count out the pause.
    """
    pause = p.converter_dead_time_pause
    if pause == 0.0:
        return base
    return max(-1.0, min(1.0, base + 2.0 * a / pause * sense(s)))


MEMORIES = {"bridge": Memory(start, advance)}


def resistance(value: float, s: Record, p: Record) -> float:
    """Resistance of the armature circuit [ohm]; the circuit is open while no bridge is ready.

    The leakage current has the sign of the current that would flow, so that the stage has one
    solution.
    """
    if p.converter_dead_time_pause == 0.0 or s.converter_dead_time_bridge * sense(s) >= 1.0:
        return value
    return value if s.armature_current == 0.0 else OPEN


def conducting(s: Record, p: Record) -> float:
    """Share of the mains period in which current flows, with the sign of the current [1]."""
    current = s.armature_current
    return current / (abs(current) + p.converter_dead_time_discontinuous_below)


def converter_voltage_drop(value: float, s: Record, p: Record) -> float:
    """Voltage that the converter loses [V]."""
    if p.converter_dead_time_drop == 0.0:
        return value
    return value + p.converter_dead_time_drop * conducting(s, p)


def measured_armature_current(value: float, s: Record, p: Record) -> float:
    """Current with its ripple [A]."""
    if p.converter_dead_time_ripple == 0.0:
        return value
    angle = 2.0 * pi * PULSES * p.converter_dead_time_mains * s.time
    wave = cos(angle + p.converter_dead_time_phase)
    return value + p.converter_dead_time_ripple * wave * abs(conducting(s, p))
