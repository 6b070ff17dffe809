"""Effects of place, of the mechanics between motor and load, and of the force that is logged."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.effects.effect import (
    FORCE,
    NONE,
    RATE,
    TIME,
    TRAVEL,
    Effect,
    Shape,
    Size,
)
from plant_emulator.diagnosis.axis.effects.gap import crossed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from plant_emulator.diagnosis.axis.effects.effect import Context, Scale, Shapes
    from plant_emulator.diagnosis.axis.motion.run import Motion
    from plant_emulator.signals.log import Array

# Travel of a revolution of a screw where none is given [m].
SCREW_PITCH = 0.005


def _gravity(c: Context, _: Shapes) -> Sequence[Array]:
    return (np.sin(c.motion.position), np.cos(c.motion.position))


def _ripple(c: Context, _: Shapes) -> Sequence[Array]:
    angle = c.motion.position * (1.0 if c.scale.rotary else 2.0 * pi / SCREW_PITCH)
    return tuple(part(k * angle) for k in (1, 2) for part in (np.sin, np.cos))


def _travels(motion: Motion, scale: Scale, revolutions: float) -> bool:
    turn = 2.0 * pi if scale.rotary else SCREW_PITCH
    return bool(np.ptp(motion.position) > revolutions * turn)


def _place(c: Context, _: Shapes) -> Sequence[Array]:
    x = (c.motion.position - c.scale.middle) / c.scale.travel
    return (x, x * c.motion.direction)


def _backlash(c: Context, s: Shapes) -> Sequence[Array]:
    """Inertia and friction behind a gap: not felt while the gap is crossed, and hit at its end."""
    m = c.motion
    free, hit = crossed(m, 0.5 * s["gap"], s["slowing"])
    return (hit - m.acceleration * free, -m.direction * free)


def _elasticity(c: Context, s: Shapes) -> Sequence[Array]:
    """q_2'' - q'' of a mass on a spring and a damper; a bilinear transform, exact at w."""
    from scipy.signal import lfilter

    m = c.motion
    step = float(np.median(np.diff(m.time)))
    even = np.arange(m.time[0], m.time[-1] + 0.5 * step, step)
    driven = np.interp(even, m.time, m.acceleration)
    w, z = min(s["frequency"], 0.9 * pi / step), s["damping"]
    t = 1.0 / np.tan(0.5 * w * step)
    upper = np.array([1.0 + 2.0 * z * t, 2.0, 1.0 - 2.0 * z * t])
    lower = np.array([t * t + 2.0 * z * t + 1.0, 2.0 - 2.0 * t * t, t * t - 2.0 * z * t + 1.0])
    return (np.interp(m.time, even, lfilter(upper, lower, driven) - driven),)


def _torque_constant(c: Context, _: Shapes) -> Sequence[Array]:
    m, b = c.motion, c.base
    load = 0.0 if m.load is None else m.load
    force = b.inertia * m.acceleration + m.friction(b) + b.offset + load
    return (force * (force / c.scale.force) ** 2,)


def _torque_constant_with_load(c: Context, s: Shapes) -> Sequence[Array]:
    """The load beside it: an error of the constant scales all that the load does not."""
    load = np.zeros(len(c.motion.time)) if c.motion.load is None else c.motion.load
    return (load, *_torque_constant(c, s))


def _delayed(force: Callable[[Array], Array], time: Array, s: Shapes) -> Array:
    return force(np.maximum(time - s["time"], time[0]))


def _lagging(force: Callable[[Array], Array], time: Array, s: Shapes) -> Array:
    """x with T x' + x = F, exactly for a force that is straight between the times."""
    from scipy.signal import lfilter

    step = float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1] + 0.5 * step, step)
    given = force(np.minimum(even, time[-1]))
    share = step / s["time"]
    kept = np.exp(-share)
    new, old = 1.0 - (1.0 - kept) / share, (1.0 - kept) / share - kept
    start = [given[0] * (1.0 - new)]
    found, _ = lfilter([new, old], [1.0, -kept], given, zi=start)
    return np.asarray(np.interp(time, even, found))


# A command is held for a sample, and its stamp is that of the sample's start or end: a delay or lag
# of less than two samples says nothing.
SHORTEST, LONGEST = 2.0, 20.0


def _timing(c: Context, _: Shapes) -> Sequence[Array]:
    return (-c.motion.slope,)


# No effect, but what every one has to stand beside: the stamps of force and motion differ.
TIMING = Effect(
    name="timing",
    title="the stamps of force and motion differ",
    subsystem="drive",
    equation="F - T F'",
    sizes=(Size(name="time", unit=TIME),),
    columns=_timing,
)
MOTION = (
    Effect(
        name="gravity",
        title="gravity pulls with the angle",
        subsystem="load",
        equation="F + a sin q + b cos q; of a lift it is the offset",
        needs="an axis that swings",
        sizes=(Size(name="sine", unit=FORCE), Size(name="cosine", unit=FORCE)),
        columns=_gravity,
        applies=lambda _, scale: scale.rotary,
    ),
    Effect(
        name="position_ripple",
        title="force swings once and twice per revolution",
        subsystem="gear",
        equation="F + sum_k s_k sin(k phi) + c_k cos(k phi), k = 1, 2, phi the motor's angle",
        needs="several revolutions",
        sizes=tuple(Size(name=f"{p}_{k}", unit=FORCE) for k in (1, 2) for p in ("sine", "cosine")),
        columns=_ripple,
        applies=lambda motion, scale: _travels(motion, scale, 2.0),
    ),
    Effect(
        name="backlash",
        title="a part of the load hangs behind a gap",
        subsystem="backlash_shaft",
        equation="F - m q'' - f sgn q' while the gap is crossed, + m dq' where it ends",
        needs="reversals",
        sizes=(
            Size(name="inertia", unit=("kg", "kg m^2"), lowest=0.0),
            Size(name="friction", unit=FORCE, lowest=0.0),
        ),
        shapes=(
            Shape(name="gap", unit=TRAVEL, lower=0.005, upper=0.5, of="travel"),
            # Of the free load by its own friction.
            Shape(name="slowing", unit=RATE, lower=0.03, upper=10.0, of="acceleration"),
        ),
        columns=_backlash,
    ),
    Effect(
        name="elasticity",
        title="a part of the inertia hangs on a spring",
        subsystem="motor_shaft",
        equation="F + m (q_2'' - q''), q_2'' + 2 z w q_2' + w^2 q_2 = 2 z w q' + w^2 q",
        needs="accelerations that change quickly",
        sizes=(Size(name="inertia", unit=("kg", "kg m^2"), lowest=0.0),),
        shapes=(
            Shape(name="frequency", unit=("rad/s", "rad/s"), lower=10.0, upper=600.0),
            Shape(name="damping", unit=NONE, lower=0.02, upper=0.7),
        ),
        columns=_elasticity,
    ),
)
FORCES = (
    Effect(
        name="torque_constant",
        title="the logged force misses a part that grows with it",
        subsystem="torque_sensor",
        equation="F + b F (F / F_rms)^2: saturation; an error of the constant needs a logged load",
        needs="large forces",
        sizes=(Size(name="saturation", unit=NONE),),
        columns=_torque_constant,
        refers=True,
        applies=lambda motion, _: motion.load is None,
    ),
    Effect(
        name="torque_constant",
        title="the logged force misses a part that grows with it",
        subsystem="torque_sensor",
        equation="F + a L + b F (F / F_rms)^2, L the load: error of the constant, and saturation",
        sizes=(Size(name="error", unit=NONE), Size(name="saturation", unit=NONE)),
        columns=_torque_constant_with_load,
        refers=True,
        applies=lambda motion, _: motion.load is not None,
    ),
    Effect(
        name="delay",
        title="the force acts later than its log says",
        subsystem="drive",
        equation="F(t - T)",
        needs="forces that change quickly",
        shapes=(Shape(name="time", unit=TIME, lower=SHORTEST, upper=LONGEST, of="period"),),
        replaced=_delayed,
    ),
    Effect(
        name="force_lag",
        title="the force follows its log as a first-order lag",
        subsystem="drive",
        equation="x with T x' + x = F",
        needs="forces that change quickly",
        shapes=(Shape(name="time", unit=TIME, lower=SHORTEST, upper=LONGEST, of="period"),),
        replaced=_lagging,
    ),
    Effect(
        name="position_dependence",
        title="force and friction change along the travel",
        subsystem="gear",
        equation="F + (k + d sgn q') x, x the position over half of the travel",
        sizes=(Size(name="force", unit=FORCE), Size(name="friction", unit=FORCE)),
        columns=_place,
    ),
)
