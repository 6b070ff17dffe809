"""What belongs to one run only: where in the gap it starts, and what its effects start from.

A run that is predicted keeps all parameters; only these states are fitted to it.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import cos, pi, sin
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.estimates import Unknown
from plant_emulator.estimation import estimate
from plant_emulator.kernel import kernel
from plant_emulator.search import GAP_POSITION, Search

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from plant_emulator.effects import Effect
    from plant_emulator.estimates import Array, Residual
    from plant_emulator.recording import Recording

    Effects = Mapping[str, Mapping[str, float]]

# Angles that are tried [rad].
ANGLES = np.linspace(-pi, pi, 24, endpoint=False)
GAP = Unknown(name=GAP_POSITION, start=0.0, lower=-1.0, upper=1.0, logarithmic=False)


def states_of(own: Effects, known: Mapping[str, Effect] | None = None) -> tuple[Unknown, ...]:
    """The states of a run, the position in the gap first.

    own : values of the effects that the bench has, by effect and parameter
    known : the effects by name; None: those of the kernel
    """
    known = known if known is not None else kernel().effects
    return (
        GAP,
        *(
            Unknown(
                name=f"{effect}_{key}",
                start=value,
                lower=declared.lower,
                upper=declared.upper,
                logarithmic=False,
                prior=value,
                std=declared.std,
                step=declared.step,
                angle=declared.angle,
            )
            for effect, values in own.items()
            for key, value in values.items()
            if (declared := known[effect].parameters[key]).per_run and declared.std is not None
        ),
    )


def with_own(
    recording: Recording, own: Effects, known: Mapping[str, Effect] | None = None
) -> Recording:
    """The recording with those parameters of effects that its own log tells."""
    known = known if known is not None else kernel().effects
    measured = {
        f"{effect}_{key}": float(np.mean(recording.log[signal]))
        for effect, values in own.items()
        for key in values
        if (signal := known[effect].parameters[key].measured) and signal in recording.log
    }
    return replace(recording, own=measured)


def fit_states(
    recording: Recording, values: Mapping[str, float], states: Sequence[Unknown]
) -> dict[str, float]:
    """States that fit a run best, all parameters as given: scans, then least squares.

    values : all parameters [SI]
    """
    values = {**values, **recording.own}
    search = Search([recording], values, ())
    search.scan_gaps(41)

    def residual(found: Mapping[str, float]) -> Array:
        trial = {**values, **found}
        return recording.residual(trial, trial.pop(GAP_POSITION))

    starts = {u.name: u.start for u in states} | {GAP_POSITION: search.gaps[0]}
    starts = scanned(residual, starts, [u for u in states if u.name != GAP_POSITION])
    unknowns = [replace(u, start=starts[u.name], run=0) for u in states]
    return estimate(unknowns, [residual]).states(0)


def combinations(states: Sequence[Unknown]) -> Iterator[tuple[dict[str, float], str | None]]:
    """Starts of all states of a run together by name, but for an angle among them, and its name."""
    angle = next((u.name for u in states if u.angle), None)
    others = [u for u in states if u.name != angle]
    for values in product(*(u.starts() for u in others)):
        yield {u.name: value for u, value in zip(others, values, strict=True)}, angle


def scanned(
    residual: Residual, found: Mapping[str, float], states: Sequence[Unknown]
) -> dict[str, float]:
    """States of a run where what has many valleys and angles starts in the best, all else as found.

    With a loss that forgives spikes at the wrong time, as `Search`; three values of an angle tell
    the others.
    """
    narrow = [u for u in states if u.step is not None or u.angle]
    if not narrow:
        return dict(found)
    trials: list[tuple[float, dict[str, float]]] = []
    for state, angle in combinations(narrow):
        trial = {**found, **state}
        if angle is None:
            trials.append((_loss(residual(trial)), trial))
            continue
        ahead, aside, behind = (residual({**trial, angle: a}) for a in (0.0, pi / 2, pi))
        middle = 0.5 * (ahead + behind)
        for a in ANGLES:
            turned = middle + cos(a) * (ahead - middle) + sin(a) * (aside - middle)
            trials.append((_loss(turned), {**trial, angle: float(a)}))
    return min(trials, key=lambda one: one[0])[1]


def _loss(residual: Array) -> float:
    return float(np.sum(np.log1p(residual**2)))
