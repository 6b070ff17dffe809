"""The forces of an axis in which a law may be missing, and the rows that judge such a law.

A law is a force beside the nominal ones in the regression of `axis/regression/fit.py`. Runs judge
it that it was not fitted to. A single run is cut into blocks of time for the choice among laws;
what is left to the runs that were held out is the test of the law that was chosen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.effects import Effect, Size
from plant_emulator.diagnosis.axis.regression.rows import Term
from plant_emulator.diagnosis.missing_law.quantity import LawQuantity
from plant_emulator.diagnosis.missing_law.reduced import LawRows, RunRows
from plant_emulator.diagnosis.missing_law.states import LawState

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.axis.motion.run import Base, Motion
    from plant_emulator.diagnosis.axis.regression.fit import Regression
    from plant_emulator.diagnosis.axis.regression.rows import Rows
    from plant_emulator.diagnosis.missing_law.states import Kind
    from plant_emulator.signals.log import Array

# Blocks of time that a single run is cut into.
BLOCKS = 5
# Prior standard deviation of a nominal parameter whose column has the length 1: none to speak of.
NOMINAL_PRIOR = 1e5


# The noise of the position makes an inertia too small. What is left then follows the acceleration,
# and is no law.
SMOOTHED_INERTIA = Term(
    Effect(
        name="smoothed_inertia",
        title="an inertia along the smoothed acceleration",
        subsystem="load",
        equation="F + m q''",
        sizes=(Size(name="mass", unit=("kg", "kg m^2")),),
        columns=lambda context, _: (context.motion.acceleration,),
    )
)


def axis_laws(regression: Regression) -> list[tuple[LawQuantity, LawRows]]:
    """The quantities of an axis, each with the rows of the fitted runs or of the blocks of one."""
    blocks = BLOCKS if len(regression.rows) == 1 else 1
    owners = [own for own in regression.rows for _ in range(blocks)]
    rows = _rows(regression, blocks)
    return [(one, rows) for one in _quantities(owners)]


def _quantities(rows: Sequence[Rows]) -> list[LawQuantity]:
    scale, motions = rows[0].scale, [one.run.motion for one in rows]
    length, force = ("rad", "N m") if scale.rotary else ("m", "N")

    def state(name: str, symbol: str, unit: str, code: str, kind: Kind) -> LawState:
        values = [_values(m, name, scale.middle) for m in motions]
        times = [m.time for m in motions]
        return LawState(
            name=name, symbol=symbol, unit=unit, code=code, kind=kind, values=values, time=times
        )

    position = "m.position - context.scale.middle"
    shared = [
        state("position", "q", length, position, "smooth"),
        state("time", "t", "s", "m.time", "time"),
    ]
    if all(m.load is not None for m in motions):
        shared.append(state("load", "L", force, "m.load", "signed"))
    if all(m.temperature is not None for m in motions):
        shared.append(state("temperature", "T", "degC", "m.temperature", "smooth"))
    velocity = state("velocity", "v", f"{length}/s", "m.velocity", "signed")
    direction = state("direction", "d", "", "m.direction", "direction")
    acceleration = state("acceleration", "a", f"{length}/s^2", "m.acceleration", "curved")
    return [
        LawQuantity(place="gear", name="friction of the axis", unit=force, hook="columns",
                    states=(velocity, direction, *shared)),
        LawQuantity(place="load", name="force on the load", unit=force, hook="columns",
                    states=(acceleration, *shared)),
    ]  # fmt: skip


def _values(motion: Motion, name: str, middle: float) -> Array:
    """Values of a state at the nodes of a run; see `LawState`."""
    found = np.asarray(getattr(motion, name))
    return found - middle if name == "position" else found


def _nominal(one: Rows, base: Base) -> Array:
    """Columns of the nominal parameters, and of an inertia along the smoothed acceleration."""
    return np.concatenate([one.nominal(), one.columns(SMOOTHED_INERTIA, base)], axis=1)


def _rows(regression: Regression, blocks: int) -> LawRows:
    """The rows of all runs, each cut into blocks, over the deviation of an independent row."""
    noise = float(np.sqrt(regression.variance / regression.independent))
    cuts = [np.array_split(np.arange(len(one.time)), blocks) for one in regression.rows]
    places = [
        (one, rows) for one, parts in zip(regression.rows, cuts, strict=True) for rows in parts
    ]
    nominal = [_nominal(one, regression.base)[rows] for one, rows in places]
    length = np.sqrt(sum((part**2).sum(axis=0) for part in nominal))
    spread = regression.spread[0] if len(regression.rows) > 1 else 0.0

    def columns(run: int, values: Array) -> Array:
        one, rows = places[run]
        averaged = (
            np.stack([one.average(law) for law in values.T], axis=1)
            if values.size
            else (np.zeros((len(one.time), values.shape[1])))
        )
        return np.asarray(averaged[rows] / noise)

    return LawRows(
        [
            RunRows(
                one.force(())[rows] / noise,
                part * (NOMINAL_PRIOR / length),
                one.own(regression.base)[rows, : int(spread > 0.0)] * spread / noise,
            )
            for (one, rows), part in zip(places, nominal, strict=True)
        ],
        columns,
    )
