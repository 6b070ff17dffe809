"""The floor of the gap: what repeats of a run leave of each other, else the sensors' noise."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.regression.fit import residual
from plant_emulator.diagnosis.wording import number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.axis.held_out import HeldOut
    from plant_emulator.diagnosis.axis.regression.rows import Rows
    from plant_emulator.signals.log import Array

# Correlation of force and position from which on two runs are repeats [1]: nine tenths of the
# variance are the same.
ALIKE = 0.95
# Least ratio of their sizes.
ALIKE_SIZE = 0.75


def sensor_floor(rows: Sequence[Rows], inertia: float) -> float:
    """Rms of the force's error that the sensors' noise makes in these rows [N or N m]."""
    squares = sum(one.noise(()) + float(np.sum(moved(one, inertia) ** 2)) for one in rows)
    return float(np.sqrt(squares / sum(len(one.time) for one in rows)))


def moved(rows: Rows, inertia: float) -> Array:
    """Force that noise of the position feigns in these rows, one draw, shape (rows,) [N or N m].

    inertia : of the axis [kg or kg m^2]
    """
    kernel = rows.run.kernel
    chance = rows.run.position_noise * np.random.default_rng(2).standard_normal(len(kernel.time))
    return np.asarray(inertia * kernel.acceleration(chance)[rows.use])


def repeat_floor(held_out: HeldOut) -> float | None:
    """Rms of what repeats leave of each other [N or N m]; None: the logs hold no repeats.

    Half of the variance of the difference of their errors: what the model lacks in both runs
    cancels, and what differs from run to run remains.
    """
    regression, rows = held_out.regression, held_out.rows
    null = regression.fit(())
    squares = []
    for a, b in combinations(rows, 2):
        both = _common(a, b)
        if both is None:
            continue
        errors = []
        for one in (a, b):
            level = regression.own_level(one, null)
            error = np.full(len(one.use), np.nan)
            error[one.use] = residual(one, null, regression.base, level)
            errors.append(error[both])
        squares.append((errors[0] - errors[1]) ** 2)
    if not squares:
        return None
    return float(np.sqrt(0.5 * np.nanmean(np.concatenate(squares))))


def _common(a: Rows, b: Rows) -> slice | None:
    """Rows that two repeats share; None: they are no repeats."""
    count = min(len(a.use), len(b.use))
    if count < 0.95 * max(len(a.use), len(b.use)):
        return None
    for of in (_position, _force):
        x, y = of(a)[:count], of(b)[:count]
        if (
            np.corrcoef(x, y)[0, 1] < ALIKE
            or not ALIKE_SIZE < np.std(x) / np.std(y) < 1.0 / ALIKE_SIZE
        ):
            return None
    return slice(0, count)


def _position(rows: Rows) -> Array:
    return np.asarray(rows.run.kernel.average(rows.run.motion.position))


def _force(rows: Rows) -> Array:
    from plant_emulator.diagnosis.axis.motion.spline import smooth

    log = rows.run.log
    return np.asarray(smooth(rows.run.kernel.time, log.force).curve(rows.run.kernel.rows))


def describe_floor(rms: float, repeats: float | None, unit: str) -> str:
    """Describe the floor in a note of the answer; rms, repeats : in the unit."""
    if repeats is None:
        told = f"the logs hold no repeats: the floor is the sensors' noise, {number(rms)} {unit}"
        return f"{told}; what a repeat would leave is not known"
    return f"repeats of a run leave {number(repeats)} {unit} of each other: the floor of the gap"
