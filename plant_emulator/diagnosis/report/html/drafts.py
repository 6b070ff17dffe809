"""The drafts of a missing law in a report: curve over its state, law, alternatives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.report.html.markup import Markup, join, tag
from plant_emulator.diagnosis.report.html.parts import code, scroll_region
from plant_emulator.diagnosis.report.html.pictures import (
    line,
    picture,
    rectangle,
    text,
    tick_label,
    ticks,
)
from plant_emulator.diagnosis.report.html.traces import draw, path, rms
from plant_emulator.diagnosis.wording import describe_draft_gain, in_words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.answer import Curve, Draft
    from plant_emulator.diagnosis.prediction.trace import Trace

# The plot of a curve [pixels].
LEFT, RIGHT, TOP, HEIGHT = 80.0, 740.0, 12.0, 220.0


# Pixel columns of a predicted signal.
COLUMNS = 340


def drafts(found: Sequence[Draft], traces: Sequence[Trace]) -> Markup:
    """Every draft with its curve; below the best one the signal that it changes most.

    traces : held-out runs, predicted without and with the best draft
    """
    if not found:
        return tag("p", "No law over the measured states closes a part of the gap for certain.")
    best, *others = found
    return join(_draft(best), _change(traces), *(_draft(one) for one in others))


def _change(traces: Sequence[Trace]) -> Markup:
    """The channel of a held-out run in which the draft takes most off the residual."""
    if not traces:
        return Markup("")
    most = max(traces, key=_fall)
    name = f"{in_words(most.channel)} of {most.source}"
    caption = f"{name}: measured, and predicted without and with the draft."
    return tag("figure", scroll_region(draw(most, COLUMNS), name), tag("figcaption", caption))


def _fall(trace: Trace) -> float:
    """Fall of the mean square of a residual, in the noise [1]."""
    before, after = (rms(trace.measured - p) for p in (trace.recalibrated, trace.explained))
    return (before**2 - after**2) / trace.noise**2 if trace.noise else 0.0


def _draft(one: Draft) -> Markup:
    facts = [f"{one.quantity}, over {one.over}", describe_draft_gain(one)]
    if one.rivals:
        facts.append(f"alternatives: {'; '.join(one.rivals)}")
    caption = (
        f"{one.curve.quantity} [{one.curve.unit}] over {one.curve.over}"
        f"{f' [{one.curve.over_unit}]' if one.curve.over_unit else ''}: curve without a formula, "
        "with its 95 % interval" + ("; dashed: the law." if one.curve.law is not None else ".")
    )
    drawn = scroll_region(_curve(one.curve, one.form), one.form)
    return join(
        tag("h3", one.form),
        tag("ul", *(tag("li", fact) for fact in facts), tag("li", "effect file ", code(one.file))),
        tag("figure", drawn, tag("figcaption", caption)),
    )


def _curve(curve: Curve, form: str) -> Markup:
    knots, values, band = (np.array(v) for v in (curve.knots, curve.values, curve.band))
    law = None if curve.law is None else np.array(curve.law)
    every = np.concatenate([values - band, values + band, *([] if law is None else [law])])
    low, high = float(every.min()), float(every.max())
    margin = 0.05 * (high - low) or 1.0
    span = float(np.ptp(knots)) or 1.0

    def x(value: np.ndarray | float) -> np.ndarray:
        return np.asarray(LEFT + (RIGHT - LEFT) * (value - knots[0]) / span)

    def y(value: np.ndarray | float) -> np.ndarray:
        share = (np.asarray(value) - low + margin) / (high - low + 2.0 * margin)
        return np.asarray(TOP + HEIGHT * (1.0 - share))

    across = ticks(float(knots[0]), float(knots[-1]), 8)
    up = ticks(low, high, 5)
    bottom = TOP + HEIGHT
    looks = [("after", values), ("edge", values - band), ("edge", values + band)]
    return picture(
        bottom + 26.0,
        f"{curve.quantity} over {curve.over}, and the law {form}",
        *(line(LEFT, float(y(v)), RIGHT, float(y(v)), "grid") for v in up),
        *(line(float(x(v)), TOP, float(x(v)), bottom, "grid") for v in across),
        rectangle(LEFT, TOP, RIGHT - LEFT, HEIGHT, "axis"),
        *(text(LEFT - 6.0, float(y(v)) + 4.0, tick_label(v, up), "end soft") for v in up),
        *(text(float(x(v)), bottom + 16.0, tick_label(v, across), "middle soft") for v in across),
        *(tag("path", d=path(x(knots), y(v), len(knots)), class_=look) for look, v in looks),
        *([] if law is None else [tag("path", d=path(x(knots), y(law), 99), class_="before")]),
    )
