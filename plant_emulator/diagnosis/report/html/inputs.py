"""Pictures of inputs that nobody measured: the estimate with its band."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.report.html.chart import chart
from plant_emulator.diagnosis.report.html.markup import Markup, join, tag
from plant_emulator.diagnosis.report.html.pictures import tick_label, ticks
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
    values = ticks(float(np.min(low)), float(np.max(high)), 5)
    labels = {tick_label(v, values): v for v in values}
    curves = ((one.value, "after"), (low, "before"), (high, "before"))
    return chart(told, "time [s]", one.time, curves, labels)
