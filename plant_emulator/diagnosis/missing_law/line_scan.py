"""The scan for ripples: at which multiples of an angle a law shows a line.

A periodogram by least squares (J. D. Scargle, Astrophysical Journal 263 (1982) 835) over the angle
in place of time. Its power is what a cosine and a sine at a multiple save in all runs, each run
with a phase of its own, beside the nuisance columns of the run. The multiple is continuous: the
grid has steps in which no line can hide, and the largest line is refined.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.missing_law.reduced import WIDE_PRIOR

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.missing_law.quantity import LawQuantity
    from plant_emulator.diagnosis.missing_law.reduced import LawRows
    from plant_emulator.diagnosis.missing_law.states import LawState
    from plant_emulator.signals.log import Array

# Smallest multiple: a slower wave is a trend.
SLOWEST = 0.5
# Lines that are taken one after the other, the largest one first.
LINES = 2
# Multiples that are tried at most: a longer log is not scanned as far.
MOST_MULTIPLES = 10_000
# Only so many multiples with the largest power come into question for the next line.
HIGH = 200
# A line is refined so often, to a tenth of the step each time.
REFINEMENTS = 2
# Radians of the longest run times the multiples that are scanned, below which no line shows.
SHORTEST_SPAN = 20.0
# Determinant of a cosine and a sine beside the nuisance below which the run does not tell them
# apart, or from it [square of their squares' sum without nuisance].
SINGULAR = 1e-9
# Multiples whose columns are computed together.
TOGETHER = 64


def with_lines(rows: LawRows, quantity: LawQuantity) -> LawQuantity:
    """The quantity with the multiples of its angles at which a law shows the largest lines."""
    states = [find_lines(rows, one) if one.kind == "angle" else one for one in quantity.states]
    return replace(quantity, states=tuple(states))


def find_lines(rows: LawRows, state: LawState) -> LawState:
    """The angle with the multiples at which a law over it shows the largest lines."""
    span = max(float(np.ptp(own)) for own in state.values)
    if (state.scanned - SLOWEST) * span <= SHORTEST_SPAN:
        return state
    step = np.pi / span
    fastest = min(state.scanned, SLOWEST + MOST_MULTIPLES * step)
    grid = np.arange(SLOWEST, fastest, step)
    nuisance = [np.concatenate([one.shared, one.own], axis=1) for one in rows.runs]
    found = []
    for _ in range(LINES):
        power = _power(rows, state, nuisance, grid)
        line, grid = grid[np.argmax(power)], grid[np.argsort(power)[-HIGH:]]
        for k in range(REFINEMENTS):
            near = line + step * 0.1**k * np.linspace(-1.0, 1.0, 21)
            near = np.clip(near, SLOWEST, fastest)
            line = near[np.argmax(_power(rows, state, nuisance, near))]
        found.append(float(line))
        grid = grid[np.abs(grid - line) > step]
        waves = [_columns(rows, state, run, np.array([line])) for run in range(len(nuisance))]
        nuisance = [
            np.concatenate([own, WIDE_PRIOR * wave], axis=1)
            for own, wave in zip(nuisance, waves, strict=True)
        ]
    return replace(state, multiples=tuple(found))


def _power(rows: LawRows, state: LawState, nuisance: Sequence[Array], multiples: Array) -> Array:
    """Squares that each multiple saves in all runs, each with a phase of its own."""
    powers = [_power_in(rows, state, run, own, multiples) for run, own in enumerate(nuisance)]
    return np.asarray(np.sum(powers, axis=0))


def _columns(rows: LawRows, state: LawState, run: int, multiples: Array) -> Array:
    """Rows of cosines, then of sines, of multiples of the angle, shape (rows, 2 k)."""
    turned = np.multiply.outer(state.values[run], multiples)
    return rows.columns(run, np.concatenate([np.cos(turned), np.sin(turned)], axis=1))


def _power_in(rows: LawRows, state: LawState, run: int, nuisance: Array, multiples: Array) -> Array:
    """Squares that each multiple saves in a run beside nuisance columns with unit priors."""
    y, count = rows.runs[run].y, nuisance.shape[1]
    free = np.linalg.qr(np.concatenate([nuisance, np.eye(count)]))[0][: len(y)]
    left = y - free @ (free.T @ y)
    found = []
    for part in np.array_split(multiples, -(-len(multiples) // TOGETHER)):
        x = _columns(rows, state, run, part)
        (c, s), (known_c, known_s) = np.split(x, 2, axis=1), np.split(free.T @ x, 2, axis=1)
        of_c, of_s = left @ c, left @ s
        whole = _products(c, c) + _products(s, s)
        cc, ss = (
            _products(c, c) - _products(known_c, known_c),
            _products(s, s) - _products(known_s, known_s),
        )
        cs = _products(c, s) - _products(known_c, known_s)
        saved = ss * of_c**2 + cc * of_s**2 - 2.0 * cs * of_c * of_s
        apart = cc * ss - cs**2
        told = apart > SINGULAR * whole**2
        found.append(np.divide(saved, apart, out=np.zeros(len(saved)), where=told))
    return np.concatenate(found)


def _products(one: Array, other: Array) -> Array:
    """Products of the columns of two arrays, each with its partner."""
    return np.asarray(np.einsum("ij,ij->j", one, other))
