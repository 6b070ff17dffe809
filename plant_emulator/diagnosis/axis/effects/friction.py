"""Effects of friction over speed, direction, displacement, load and time.

B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.effects.effect import (
    FORCE,
    NONE,
    SPEED,
    TIME,
    TRAVEL,
    Effect,
    Shape,
    Size,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.axis.effects.effect import Context, Scale, Shapes
    from plant_emulator.diagnosis.axis.motion.run import Motion
    from plant_emulator.signals.log import Array


def _viscous_asymmetry(c: Context, _: Shapes) -> Sequence[Array]:
    return (np.abs(c.motion.velocity),)


def _coulomb_asymmetry(c: Context, _: Shapes) -> Sequence[Array]:
    return (c.motion.direction**2,)


def _stribeck(c: Context, s: Shapes) -> Sequence[Array]:
    return (np.exp(-((c.motion.velocity / s["speed"]) ** 2)) * c.motion.direction,)


def _concave(c: Context, _: Shapes) -> Sequence[Array]:
    return (np.sqrt(np.abs(c.motion.velocity) / c.scale.speed) * c.motion.direction,)


def _quadratic(c: Context, _: Shapes) -> Sequence[Array]:
    return (c.motion.velocity * np.abs(c.motion.velocity),)


def _presliding(c: Context, s: Shapes) -> Sequence[Array]:
    """z - sgn q', dz/dq = (1 - z sgn q') / x, exactly between two reversals."""
    return (bristle(c.motion.position, s["displacement"]) - np.sign(c.motion.velocity),)


def bristle(position: Array, displacement: float) -> Array:
    """State of a bristle that bends over a displacement, -1 to 1, shape as the positions."""
    step = np.diff(position, prepend=position[0])
    sign = np.sign(step)
    turns = np.flatnonzero(np.diff(sign) != 0.0) + 1
    found, start = np.empty(len(position)), 0.0
    edges = [0, *turns.tolist(), len(position)]
    for first, last in pairwise(edges):
        way = sign[first]
        moved = np.abs(position[first:last] - position[max(0, first - 1)])
        found[first:last] = way + (start - way) * np.exp(-moved / displacement)
        start = found[last - 1]
    return found


def _load_friction(c: Context, _: Shapes) -> Sequence[Array]:
    m = c.motion
    load = c.base.inertia * m.acceleration if m.load is None else m.load
    return (np.abs(load) * m.direction,)


def _warm_up(c: Context, s: Shapes) -> Sequence[Array]:
    m = c.motion
    return (m.friction(c.base) * np.exp(-m.time / s["time"]),)


def _temperature(c: Context, _: Shapes) -> Sequence[Array]:
    m = c.motion
    known = np.zeros(len(m.time)) if m.temperature is None else m.temperature
    return (m.friction(c.base) * (known - np.mean(known)),)


def _has_no_temperature(m: Motion, _: Scale) -> bool:
    return m.temperature is None


def _has_a_temperature(m: Motion, _: Scale) -> bool:
    return m.temperature is not None and bool(np.ptp(m.temperature) > 0.0)


FRICTION = (
    Effect(
        name="viscous_asymmetry",
        title="viscous friction differs by direction",
        subsystem="gear",
        equation="F + d |q'|: viscous friction F_v + d forwards, F_v - d backwards",
        needs="motion in both directions",
        sizes=(Size(name="difference", unit=("N s/m", "N m s/rad")),),
        columns=_viscous_asymmetry,
    ),
    Effect(
        name="coulomb_asymmetry",
        title="Coulomb friction differs by direction",
        subsystem="gear",
        equation="F + d |sgn q'|: an offset that acts only while the axis moves",
        needs="rests, and an offset that is known",
        sizes=(Size(name="difference", unit=FORCE),),
        columns=_coulomb_asymmetry,
    ),
    Effect(
        name="stribeck",
        title="friction rises towards standstill",
        subsystem="gear",
        equation="F + F_s exp(-(q'/v_s)^2) sgn q'",
        needs="slow motion",
        sizes=(Size(name="rise", unit=FORCE, lowest=0.0),),
        # A rise that is narrower than the change of the sign would only mend its form, and one over
        # most of the speeds is a curve of the friction.
        shapes=(Shape(name="speed", unit=SPEED, lower=0.005, upper=0.2, of="speed", widths=4.0),),
        columns=_stribeck,
    ),
    Effect(
        name="concave_friction",
        title="friction rises ever slower with speed",
        subsystem="gear",
        equation="F + c sqrt(|q'| / v) sgn q', v the highest speed",
        needs="several speeds",
        sizes=(Size(name="rise", unit=FORCE, lowest=0.0),),
        columns=_concave,
    ),
    Effect(
        name="quadratic_drag",
        title="a drag grows with the square of the speed",
        subsystem="load",
        equation="F + k q' |q'|",
        needs="high speeds",
        sizes=(Size(name="coefficient", unit=("N s^2/m^2", "N m s^2/rad^2"), lowest=0.0),),
        columns=_quadratic,
    ),
    Effect(
        name="presliding",
        title="friction builds up over a small displacement",
        subsystem="gear",
        equation="F + F_p (z - sgn q'), dz/dq = (1 - z sgn q') / x",
        needs="reversals",
        sizes=(Size(name="force", unit=FORCE, lowest=0.0),),
        # Over a large displacement a bristle is a spring.
        shapes=(Shape(name="displacement", unit=TRAVEL, lower=0.002, upper=0.1, of="travel"),),
        columns=_presliding,
    ),
    Effect(
        name="load_friction",
        title="friction grows with the load",
        subsystem="gear",
        equation="F + mu |T| sgn q', T the logged load, else M q''",
        needs="several loads, or accelerations",
        # A friction as large as the force that it grows with holds the axis.
        sizes=(Size(name="ratio", unit=NONE, lowest=0.0, highest=1.0),),
        columns=_load_friction,
        refers=True,
    ),
    Effect(
        name="warm_up",
        title="friction changes while the axis runs warm",
        subsystem="gear",
        equation="F + r (F_v q' + F_c sgn q') exp(-t / T), or r (theta - mean) in its place",
        needs="a start, and time",
        sizes=(Size(name="ratio", unit=NONE),),
        shapes=(Shape(name="time", unit=TIME, lower=0.03, upper=1.0, of="length"),),
        columns=_warm_up,
        refers=True,
        applies=_has_no_temperature,
    ),
    Effect(
        name="warm_up",
        title="friction changes with the temperature",
        subsystem="gear",
        equation="F + r (F_v q' + F_c sgn q') (theta - mean)",
        needs="a temperature that changes",
        sizes=(Size(name="ratio", unit=("1/K", "1/K")),),
        columns=_temperature,
        refers=True,
        applies=_has_a_temperature,
    ),
)
