"""A drafted law of an axis as the text of an effect file; see `workflows/axis_files`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.missing_law.effect_text import SHAPE_FACTOR, formula, unit_of

if TYPE_CHECKING:
    from plant_emulator.diagnosis.missing_law.grammar import Factor, Term
    from plant_emulator.diagnosis.missing_law.law_search import Law

TEXT = '''"""A drafted law of the {name}: {states}.

F + {formula} [{unit}]

Source: drafted by `diagnose` from logs whose cause no effect of the library is. The law closes the
gap of runs that it was not fitted to; it is no physics until somebody says which.
"""

import numpy as np

from plant_emulator.diagnosis.axis.effects import Shape, Size

SUBSYSTEM = "{place}"
SIZES = (
{sizes})
SHAPES = ({shapes})


def columns(context, shapes):
    m = context.motion
    return (
{columns}    )
'''


def axis_effect_text(law: Law) -> str:
    """Text of the effect file of a law of an axis."""
    numbered = list(enumerate(law.terms, 1))
    shapes = [
        _shape(f"b{k}{j}", factor)
        for k, term in numbered
        for j, factor in enumerate(term.factors, 1)
        if factor.function == "bell"
    ]
    return TEXT.format(
        name=law.quantity.name,
        states="by " + ", ".join(law.over) if law.over else "a constant",
        formula=formula(law),
        unit=law.quantity.unit,
        place=law.quantity.place,
        sizes="".join(f"    {_size(f'a{k}', unit_of(law, term))},\n" for k, term in numbered),
        shapes="\n" + "".join(f"    {one},\n" for one in shapes) if shapes else "",
        columns="".join(f"        {_column(k, term)},\n" for k, term in numbered),
    )


def _size(name: str, unit: str) -> str:
    return f'Size(name="{name}", unit=("{unit}", "{unit}"))'


def _shape(name: str, factor: Factor) -> str:
    low, high = factor.scale / SHAPE_FACTOR, factor.scale * SHAPE_FACTOR
    unit = factor.state.unit
    return f'Shape(name="{name}", unit=("{unit}", "{unit}"), lower={low:.4g}, upper={high:.4g})'


def _column(k: int, term: Term) -> str:
    factors = [_code(f"b{k}{j}", factor) for j, factor in enumerate(term.factors, 1)]
    return " * ".join(factors) or "np.ones(len(m.time))"


def _code(name: str, factor: Factor) -> str:
    x = f"({factor.state.code})"
    return {
        "linear": x,
        "size": f"np.abs{x}",
        "square": f"{x} * np.abs{x}",
        "root": f"np.sign{x} * np.sqrt(np.abs{x})",
        "sign": f"np.sign{x}",
        "bell": f'np.exp(-(({x} / shapes["{name}"]) ** 2))',
    }[factor.function]
