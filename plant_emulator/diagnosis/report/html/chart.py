"""A picture of curves over one axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.report.html.markup import tag
from plant_emulator.diagnosis.report.html.pictures import (
    line,
    picture,
    rectangle,
    text,
    tick_label,
    ticks,
)
from plant_emulator.diagnosis.report.html.traces import (
    FINEST,
    LEFT,
    PANEL,
    RIGHT,
    TOP,
    linear_scale,
    path,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.report.html.markup import Markup
    from plant_emulator.signals.log import Array


def chart(
    told: str,
    title: str,
    over: Array,
    curves: Sequence[tuple[Array, str]],
    labels: Mapping[str, float],
    marked: Sequence[float] = (),
) -> Markup:
    """Curves, each with its look; told : the picture's text for readers who do not see it.

    over, title : values of the horizontal axis, shape (n,), and its title
    labels : of the vertical axis, each with its value
    marked : places of the horizontal axis that have a line
    """
    first, last = float(over[0]), float(over[-1])
    values = [*np.concatenate([v for v, _ in curves]), *labels.values()]
    x = linear_scale(first, last, LEFT, RIGHT)
    y = linear_scale(float(np.min(values)), float(np.max(values)), TOP + PANEL, TOP)
    marks = ticks(first, last, 10)
    across = {tick_label(v, marks): float(x(np.asarray(v))) for v in marks}
    up = {label: float(y(np.asarray(v))) for label, v in labels.items()}
    lines = [float(x(np.asarray(v))) for v in marked if first <= v <= last]
    bottom = TOP + PANEL
    return picture(
        bottom + 34.0,
        told,
        *(line(LEFT, place, RIGHT, place, "grid") for place in up.values()),
        *(line(place, TOP, place, bottom, "floor") for place in lines),
        rectangle(LEFT, TOP, RIGHT - LEFT, PANEL, "axis"),
        *(tag("path", d=path(x(over), y(v), FINEST), class_=look) for v, look in curves),
        *(text(LEFT - 6.0, place + 4.0, label, "end soft") for label, place in up.items()),
        *(text(place, bottom + 15.0, label, "middle soft") for label, place in across.items()),
        text((LEFT + RIGHT) / 2.0, bottom + 30.0, title, "middle soft"),
    )
