"""What some law could still predict on the held-out runs, beside what is named.

An effect that is not in the library leaves a force that follows some state: a curve over it, fitted
on the fitted runs, predicts a part of the held-out runs. The curves have no physics. They tell that
a law is missing and over which state, not which law.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.effects.effect import FORCE, Effect, Size
from plant_emulator.diagnosis.axis.effects.friction import bristle
from plant_emulator.diagnosis.axis.regression.rows import Term

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from plant_emulator.diagnosis.axis.effects.effect import Context, Shapes
    from plant_emulator.diagnosis.axis.held_out import HeldOut, Share
    from plant_emulator.signals.log import Array

# Terms of a curve.
ORDER = 4
# Displacements over which a friction may build up, in half of the travel.
DISPLACEMENTS = (0.003, 0.01, 0.03, 0.1, 0.3)
# Samples ago at which a force may still act.
AGO = (0, 2, 4, 8, 16)


def _powers(x: Array) -> list[Array]:
    """Legendre polynomials of a state between -1 and 1."""
    return list(np.polynomial.legendre.legvander(x, ORDER)[:, 1:].T)


def _speed(c: Context, _: Shapes) -> Sequence[Array]:
    m = c.motion
    ratio = np.clip(np.abs(m.velocity) / c.scale.speed, 0.0, 1.0)
    # Over the root of the speed a curve is fine where friction changes most.
    even = _powers(2.0 * np.sqrt(ratio) - 1.0)
    return [*even, *(p * m.direction for p in even)]


def _position(c: Context, _: Shapes) -> Sequence[Array]:
    m = c.motion
    curve = _powers(np.clip((m.position - c.scale.middle) / c.scale.travel, -1.0, 1.0))
    return [*curve, *(p * m.direction for p in curve)]


def _angle(c: Context, _: Shapes) -> Sequence[Array]:
    q = c.motion.position
    return [part(k * q) for k in (1, 2) for part in (np.sin, np.cos)]


def _acceleration(c: Context, _: Shapes) -> Sequence[Array]:
    m = c.motion
    a = m.acceleration / float(np.abs(m.acceleration).max())
    return [np.abs(a), np.abs(a) * m.direction, a * np.abs(a), a**3]


def _load(c: Context, _: Shapes) -> Sequence[Array]:
    m = c.motion
    load = np.zeros(len(m.time)) if m.load is None else m.load
    x = load / (float(np.abs(load).max()) or 1.0)
    return [x, np.abs(x), np.abs(x) * m.direction, x**3]


def _time(c: Context, _: Shapes) -> Sequence[Array]:
    m = c.motion
    return [p * m.friction(c.base) for p in _powers(2.0 * m.time / c.scale.length - 1.0)]


def _past(c: Context, _: Shapes) -> Sequence[Array]:
    m = c.motion
    return [bristle(m.position, d * c.scale.travel) for d in DISPLACEMENTS]


def _filter(c: Context, _: Shapes) -> Sequence[Array]:
    m = c.motion
    return [np.interp(m.time - k * c.scale.period, m.time, m.slope) for k in AGO]


def _state(
    name: str,
    columns: Callable[[Context, Shapes], Sequence[Array]],
    count: int,
    *,
    refers: bool = False,
) -> Effect:
    return Effect(
        name=name,
        title=name,
        subsystem="gear",
        equation="a curve",
        sizes=tuple(Size(name=str(k), unit=FORCE) for k in range(count)),
        columns=columns,
        refers=refers,
    )


FORCE_BEFORE = _state("the force before", _filter, len(AGO))
ANGLE = _state("the angle", _angle, 4)
LOAD = _state("the load", _load, 4)
STATES = (
    _state("the speed", _speed, 2 * ORDER),
    _state("the position", _position, 2 * ORDER),
    _state("the acceleration", _acceleration, 4),
    _state("the time", _time, ORDER, refers=True),
    _state("the way since a reversal", _past, len(DISPLACEMENTS)),
)


@dataclass(frozen=True, kw_only=True)
class Rest:
    """The state over which a further law closes most, and the share that it closes."""

    state: str
    share: Share


def rest_of(held_out: HeldOut, terms: Sequence[Term]) -> Rest:
    """What a law over one state would close on the held-out runs beside these effects."""
    first = held_out.rows[0]
    states = [*STATES, *([ANGLE] if first.scale.rotary else [])]
    if all(r.run.motion.load is not None for r in held_out.rows):
        states.append(LOAD)
    if terms:
        # A lag may stand for a delay, or a spring for a load that is not logged.
        states.append(FORCE_BEFORE)
    found = [rest_over(state, held_out, terms) for state in states]
    return max(found, key=lambda one: one.share.low)


def rest_over(state: Effect, held_out: HeldOut, terms: Sequence[Term]) -> Rest:
    """What a law over this state would close on the held-out runs beside these effects.

    A command is held for a sample, so that the stamps of force and motion may differ. The law has
    to close its share with and without such a shift.
    """
    both = (
        held_out.share((*terms, Term(state)), terms, timing=shifted) for shifted in (False, True)
    )
    return Rest(state=state.name, share=min(both, key=lambda one: one.low))
