"""A part of the drum's mass is connected elastically, like a ring on worn keys.

    T_d = ... - (k psi + d psi'),   psi' = omega_d - omega_2,   J_2 omega_2' = k psi + d psi'
    k = J_2 (2 pi f)^2,   d = 2 D J_2 2 pi f

Source: W. Leonhard, Control of Electrical Drives, chapter on drives with elastic coupling. J_2 = 0:
a rigid drum.
"""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drum"
PARAMETERS = {
    "inertia": EffectParameter(
        neutral=0.0, lower=0.0, upper=300.0, plausible=20.0, unit="kg m^2", meaning="J_2"
    ),
    "frequency": EffectParameter(
        neutral=2.5, lower=0.1, upper=20.0, plausible=2.5, unit="Hz", meaning="f"
    ),
    "damping_ratio": EffectParameter(
        neutral=0.05, lower=0.0, upper=1.0, plausible=0.05, unit="1", meaning="D"
    ),
}


def start(p: Record) -> float:
    """Twist [rad] and speed [rad/s] at the start of a run: 0, because the bench is at rest."""
    return 0.0


def rate(p: Record) -> float:
    """Natural angular frequency of the ring on a fixed drum [rad/s]."""
    return 2.0 * pi * p.two_mass_drum_frequency


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Twist of the keys at the end of an implicit stage of size a [rad]."""
    return base + a * (s.drum_speed - s.two_mass_drum_speed)


def advance_speed(base: float, a: float, s: Record, p: Record) -> float:
    """Speed of the ring at the end of the stage [rad/s].

    It runs after `advance` and recovers that base from its result.
    """
    twist = s.two_mass_drum_twist + a * s.two_mass_drum_speed
    k, d = rate(p) ** 2, 2.0 * p.two_mass_drum_damping_ratio * rate(p)
    return (base + a * (k * twist + d * s.drum_speed)) / (1.0 + a * (k * a + d))


MEMORIES = {"twist": Memory(start, advance), "speed": Memory(start, advance_speed)}


def drum_torque(value: float, s: Record, p: Record) -> float:
    """External torque on the drum plus the torque of the ring [N m]."""
    inertia = p.two_mass_drum_inertia
    if inertia == 0.0:
        return value
    damped = 2.0 * p.two_mass_drum_damping_ratio * rate(p) * (s.drum_speed - s.two_mass_drum_speed)
    return value - inertia * (rate(p) ** 2 * s.two_mass_drum_twist + damped)
