"""From logs to a regression in the noise of its own rows."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.effects import LIBRARY
from plant_emulator.diagnosis.axis.effects.effect import Scale
from plant_emulator.diagnosis.axis.floor import moved
from plant_emulator.diagnosis.axis.motion.run import Base, prepare, with_width
from plant_emulator.diagnosis.axis.regression.fit import Regression
from plant_emulator.diagnosis.axis.regression.rows import KnownEffect, Rows, Term, rows_of
from plant_emulator.diagnosis.axis.settings import SETTINGS
from plant_emulator.signals.noise import noise

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.axis.effects.effect import Effect
    from plant_emulator.diagnosis.axis.motion.run import Run
    from plant_emulator.diagnosis.axis.regression.fit import Fit
    from plant_emulator.signals.axis_log import AxisLog
    from plant_emulator.signals.log import Array

# Widths of the Coulomb friction that are tried, in the highest speed.
WIDTHS = (0.0003, 0.1)
# White noise of the rows over that of third differences, for a noise with a memory of five samples:
# r = exp(-1/5), sqrt((1 + r) / (1 - r)) over sqrt((20 - 30 r + 12 r^2 - 2 r^3) / 20).
LASTING = 9.2
# Nominal parameters before the first fit.
NOTHING = Base(inertia=0.0, viscous=0.0, coulomb=0.0)


def prepared(logs: Sequence[AxisLog]) -> tuple[list[Run], Scale]:
    """The runs, and how large their axis is.

    All are averaged over one time: over the longest that the noise of one of them asks for.
    """
    first = [prepare(log) for log in logs]
    width = max(run.kernel.stride * run.period for run in first)
    runs = [
        replace(run, kernel=replace(run.kernel, stride=max(1, round(width / run.period))))
        for run in first
    ]
    return runs, scale_of(runs)


def best_width(
    runs: Sequence[Run],
    scale: Scale,
    terms: Sequence[Term],
    known: tuple[KnownEffect, ...] = (),
) -> float:
    """Width of the Coulomb friction that leaves least of these runs beside these effects.

    The width is a speed [m/s or rad/s].
    """
    from scipy.optimize import minimize_scalar

    least = max(run.motion.deviation for run in runs)

    def cost(width: float) -> float:
        rows = [rows_of(with_width(run, width), scale, known) for run in runs]
        begun = Regression(rows=rows, base=NOTHING)
        return begun.around(begun.fit(())).fit(terms).cost

    tried = [least, *(w for w in np.geomspace(*WIDTHS, SETTINGS.grid) * scale.speed if w > least)]
    costs = [cost(w) for w in tried]
    k = int(np.argmin(costs))
    low, high = np.log(tried[max(0, k - 1)]), np.log(tried[min(k + 1, len(tried) - 1)])
    found = minimize_scalar(lambda x: cost(float(np.exp(x))), bounds=(low, high), method="bounded")
    return float(np.exp(found.x)) if found.fun < costs[k] else float(tried[k])


def start(
    runs: Sequence[Run],
    scale: Scale,
    fitted: int,
    effects: Sequence[Effect],
    width: float,
    known: tuple[KnownEffect, ...] = (),
) -> tuple[Regression, list[Rows], list[Effect]]:
    """Regression of the first `fitted` runs, rows of all runs, and the effects that apply.

    width : of the Coulomb friction; known : effects of the parameter set
    """
    rows = [rows_of(with_width(run, width), scale, known) for run in runs]
    usable = [e for e in effects if e.has_room(scale)]
    library = [e for e in usable if all(e.applies(r.motion, scale) for r in runs)]
    begun = Regression(rows=rows[:fitted], base=NOTHING)
    around = begun.around(begun.fit(()))
    rich = richest(around, library, scale)
    force, position = sensor_noise(around, rich)
    for one in rows:
        one.run = replace(
            one.run, force_noise=force, position_noise=position * one.run.position_noise
        )
    # A delay that only takes noise away is no part of the reference of other effects.
    base = around.linear(rich_terms(library, scale), around.base)
    return around.in_noise_of(rich).around(base), rows, library


def richest(around: Regression, library: Sequence[Effect], scale: Scale) -> Fit:
    """The fit of all linear effects, beside the delay or lag with which least noise is left.

    The library may lack delay and lag; the noise does not depend on that.
    """
    linear = rich_terms(library, scale)
    late = [(Term(e, s),) for e in LIBRARY if e.replaced for s in grid(e, scale)]
    first = around.linear(linear, around.base)
    best = min(
        (around.linear([*linear, *terms], around.base) for terms in late),
        key=lambda fit: sensor_noise(around, fit)[0],
    )
    # The least of many estimates is too small: it counts where it is another one.
    both = [sensor_noise(around, fit)[0] ** 2 for fit in (first, best)]
    return best if SETTINGS.noisy * both[1] < both[0] else first


def sensor_noise(around: Regression, rich: Fit) -> tuple[float, float]:
    """Deviation of the force's noise, and share of the position's noise, in what a fit leaves.

    Noise is what changes from row to row beside a rich model. A force that changes quickly is none
    where the axis follows it, nor is a quick motion where a force makes it. A force that the logs
    lack changes from row to row too, but not from sample to sample: noise of the force is at most
    what its samples show, if it remembers few of them.
    """
    most = LASTING * np.sqrt(np.mean([noise(one.run.log.force) ** 2 for one in around.rows]))
    left = force = position = 0.0
    for k, one in enumerate(around.rows):
        left += _rough(one, around.residual(rich, k)) ** 2
        force += _rough(one, one.chance(rich.terms)) ** 2
        position += _rough(one, moved(one, rich.base.inertia)) ** 2
    share = min(1.0, np.sqrt(left / max(position, 1e-300)))
    return float(min(most, np.sqrt(max(0.0, left - position) / force))), float(share)


def _rough(rows: Rows, values: Array) -> float:
    """Deviation of what changes from row to row, of values at the rows that count."""
    whole = np.zeros(len(rows.use))
    whole[rows.use] = values
    return noise(whole, rows.use)


def rich_terms(library: Sequence[Effect], scale: Scale) -> list[Term]:
    """Every effect that enters linearly, its shapes in the middle of their bounds."""
    return [middle_term(e, scale) for e in library if e.columns is not None]


def grid(effect: Effect, scale: Scale) -> list[tuple[float, ...]]:
    """Shapes of an effect that are tried first."""
    return list(product(*(np.geomspace(*s.bounds(scale), SETTINGS.grid) for s in effect.shapes)))


def middle_term(effect: Effect, scale: Scale) -> Term:
    """An effect with its shapes in the middle of their bounds."""
    return Term(effect, tuple(float(np.sqrt(np.prod(s.bounds(scale)))) for s in effect.shapes))


def scale_of(runs: Sequence[Run]) -> Scale:
    """Estimate the magnitudes of the axis from its runs."""
    low = min(float(r.motion.position.min()) for r in runs)
    high = max(float(r.motion.position.max()) for r in runs)
    return Scale(
        force=float(np.sqrt(np.mean(np.concatenate([r.log.force for r in runs]) ** 2))),
        speed=max(float(np.abs(r.motion.velocity).max()) for r in runs),
        acceleration=float(
            np.sqrt(np.mean(np.concatenate([r.motion.acceleration for r in runs]) ** 2))
        ),
        middle=0.5 * (low + high),
        travel=0.5 * (high - low),
        period=max(r.period for r in runs),
        length=max(float(r.kernel.time[-1]) for r in runs),
        rotary=runs[0].log.rotary,
    )
