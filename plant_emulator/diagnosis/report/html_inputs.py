"""Pictures of inputs that nobody measured: the estimate with its band."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.report.html_pictures import (
    line,
    picture,
    rectangle,
    text,
    tick_label,
    ticks,
)
from plant_emulator.diagnosis.report.html_traces import (
    FINEST,
    LEFT,
    PANEL,
    RIGHT,
    TOP,
    linear_scale,
    path,
)
from plant_emulator.diagnosis.report.markup import Markup, join, tag
from plant_emulator.diagnosis.wording import replace_unprintable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.report.details import EstimatedInput


def estimated_inputs(inputs: Sequence[EstimatedInput]) -> Markup:
    """A figure of each estimated input."""
    return join(*(_figure(one) for one in inputs))


def _figure(one: EstimatedInput) -> Markup:
    words = (
        f"{one.name} of {replace_unprintable(one.source)} [{one.unit}]: estimated, nobody measured "
        "it; the dashed lines are two standard deviations away"
    )
    return tag("figure", tag("figcaption", words), draw(one, words))


def draw(one: EstimatedInput, told: str) -> Markup:
    """The picture of an estimated input over time."""
    low, high = one.value - 2.0 * one.deviation, one.value + 2.0 * one.deviation
    first, last = float(one.time[0]), float(one.time[-1])
    least, most = float(np.min(low)), float(np.max(high))
    x = linear_scale(first, last, LEFT, RIGHT)
    y = linear_scale(least, most, TOP + PANEL, TOP)
    times, values = ticks(first, last, 10), ticks(least, most, 5)
    across = {tick_label(t, times): float(x(np.asarray(t))) for t in times}
    up = {tick_label(v, values): float(y(np.asarray(v))) for v in values}
    curves = ((one.value, "after"), (low, "before"), (high, "before"))
    bottom = TOP + PANEL
    return picture(
        bottom + 34.0,
        told,
        *(line(LEFT, place, RIGHT, place, "grid") for place in up.values()),
        rectangle(LEFT, TOP, RIGHT - LEFT, PANEL, "axis"),
        *(tag("path", d=path(x(one.time), y(v), FINEST), class_=look) for v, look in curves),
        *(text(LEFT - 6.0, place + 4.0, label, "end soft") for label, place in up.items()),
        *(text(place, bottom + 15.0, label, "middle soft") for label, place in across.items()),
        text((LEFT + RIGHT) / 2.0, bottom + 30.0, "time [s]", "middle soft"),
    )
