"""Pictures of the held-out runs: measured and predicted, with the residuals below.

A curve of many samples is drawn by the smallest and the largest value of every pixel column. It
then shows every spike, and the file stays small.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.report.html.markup import Markup, join, tag
from plant_emulator.diagnosis.report.html.pictures import (
    WIDTH,
    line,
    picture,
    rectangle,
    text,
    tick_label,
    ticks,
)
from plant_emulator.diagnosis.wording import in_words, number, quantity, replace_unprintable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.prediction.trace import Trace
    from plant_emulator.signals.log import Array

    Axis = Callable[[Array], Array]

LEFT, RIGHT = 60.0, WIDTH - 12.0
# Upper panel, then the strips of the residual [pixel].
TOP, PANEL, GAP, STRIP, BELOW = 8.0, 130.0, 22.0, 46.0, 34.0
# Pixel columns of a curve, fewer where many curves share the file.
FINEST, COARSEST, COLUMNS_IN_ALL = 680, 120, 90_000
# Share of the residuals that a strip shows, and its least half height in multiples of the noise.
SHOWN, LEAST = 0.995, 4.0


def residuals(trace: Trace) -> dict[str, Array]:
    """Measured minus predicted, before and after the effects; only before where there are none."""
    before = trace.measured - trace.recalibrated
    if np.array_equal(trace.recalibrated, trace.explained, equal_nan=True):
        return {"before": before}
    return {"before": before, "after": trace.measured - trace.explained}


def rms(residual: Array) -> float:
    """Root of the mean square of the finite samples."""
    counted = residual[np.isfinite(residual)]
    return float(np.sqrt(np.mean(counted**2))) if len(counted) else float("nan")


def columns_of(traces: Sequence[Trace]) -> int:
    """Pixel columns of a curve that keep the file small, whatever the number of curves is."""
    return int(np.clip(COLUMNS_IN_ALL // max(1, 5 * len(traces)), COARSEST, FINEST))


def summary(trace: Trace) -> str:
    """Rms of the residuals, and the noise, of a trace in its unit."""
    found = residuals(trace)
    when = found if len(found) > 1 else ("",)
    parts = [
        f"{quantity(rms(r), trace.unit)} {key}".rstrip()
        for key, r in zip(when, found.values(), strict=True)
    ]
    return f"rms of the residual {', '.join(parts)}; noise {quantity(trace.noise, trace.unit, 2)}"


def draw(trace: Trace, columns: int) -> Markup:
    """The picture of one channel of one run."""
    found = residuals(trace)
    bottom = TOP + PANEL + len(found) * (GAP + STRIP)
    times = _finite(trace.time)
    x = linear_scale(times[0], times[-1], LEFT, RIGHT)
    limit = _limit(trace, found)
    strips = [
        _strip(
            trace,
            key,
            f"residual {key}" if len(found) > 1 else "residual",
            residual,
            x,
            limit,
            TOP + PANEL + GAP + k * (GAP + STRIP),
            columns,
        )
        for k, (key, residual) in enumerate(found.items())
    ]
    marks = ticks(float(times[0]), float(times[-1]), 10)
    return picture(
        bottom + BELOW,
        f"{in_words(trace.channel)} of {replace_unprintable(trace.source)} over time, measured and "
        f"predicted; {summary(trace)}",
        *(line(_at(x, t), TOP, _at(x, t), bottom, "grid") for t in marks),
        _panel(trace, found, x, columns),
        *strips,
        *(text(_at(x, t), bottom + 15.0, tick_label(t, marks), "middle soft") for t in marks),
        text((LEFT + RIGHT) / 2.0, bottom + 30.0, "time [s]", "middle soft"),
    )


def _panel(trace: Trace, found: dict[str, Array], x: Axis, columns: int) -> Markup:
    curves = {"measured": trace.measured, "before": trace.recalibrated}
    if "after" in found:
        curves["after"] = trace.explained
    values = _finite(np.concatenate(list(curves.values())))
    low, high = float(values.min()), float(values.max())
    margin = 0.04 * (high - low) or 1.0
    y = linear_scale(low - margin, high + margin, TOP + PANEL, TOP)
    marks = ticks(low - margin, high + margin, 5)
    return join(
        *(line(LEFT, _at(y, v), RIGHT, _at(y, v), "grid") for v in marks),
        rectangle(LEFT, TOP, RIGHT - LEFT, PANEL, "axis"),
        *(text(LEFT - 6.0, _at(y, v) + 4.0, tick_label(v, marks), "end soft") for v in marks),
        *(
            tag("path", d=path(x(trace.time), y(values), columns), class_=look)
            for look, values in curves.items()
        ),
    )


def _strip(
    trace: Trace,
    key: str,
    title: str,
    residual: Array,
    x: Axis,
    limit: float,
    top: float,
    columns: int,
) -> Markup:
    """A residual over a band of 2 standard deviations; the title tells a value beyond the strip."""
    y = linear_scale(-limit, limit, top + STRIP, top)
    edges = [_at(y, sign * 2.0 * trace.noise) for sign in (1.0, -1.0)]
    largest = float(np.abs(_finite(residual)).max())
    title = f"{title} [{trace.unit}], rms {number(rms(residual))}"
    if largest > limit:
        title += f", largest {number(largest)}"
    marks = [-_round(limit), 0.0, _round(limit)]
    return join(
        text(LEFT, top - 6.0, title),
        rectangle(LEFT, edges[0], RIGHT - LEFT, edges[1] - edges[0], "band"),
        line(LEFT, _at(y, 0.0), RIGHT, _at(y, 0.0), "axis"),
        rectangle(LEFT, top, RIGHT - LEFT, STRIP, "axis"),
        *(text(LEFT - 6.0, _at(y, v) + 4.0, tick_label(v, marks), "end soft") for v in marks),
        tag(
            "path",
            d=path(x(trace.time), y(np.clip(residual, -limit, limit)), columns),
            class_=f"strip {key}",
        ),
        *(line(LEFT, y_band, RIGHT, y_band, "edge") for y_band in edges),
    )


def _limit(trace: Trace, found: dict[str, Array]) -> float:
    """Half height of both strips [unit]."""
    bulk = max(float(np.quantile(np.abs(_finite(r)), SHOWN)) for r in found.values())
    return max(1.1 * bulk, LEAST * trace.noise, 1e-12)


def _round(limit: float) -> float:
    """The largest round value within a limit."""
    return ticks(0.0, limit, 2)[-1] if len(ticks(0.0, limit, 2)) > 1 else limit


def path(x: Array, y: Array, columns: int) -> str:
    """An SVG path through the finite points, thinned to the columns."""
    good = np.isfinite(x) & np.isfinite(y)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]]).astype(int)))
    found = []
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        kept = first + extreme_indices(x[first:end], y[first:end], (RIGHT - LEFT) / columns)
        found.append(_polyline(x[kept], y[kept]))
    return "".join(found)


def extreme_indices(x: Array, y: Array, pitch: float) -> NDArray[np.intp]:
    """Indices of the smallest and the largest y in every column of this width, and of both ends."""
    if len(x) <= 3:
        return np.arange(len(x))
    column = np.floor(x / pitch)
    order = np.lexsort((y, column))
    first = np.flatnonzero(np.diff(column[order], prepend=-np.inf))
    last = np.append(first[1:] - 1, len(x) - 1)
    return np.unique(np.concatenate([order[first], order[last], [0, len(x) - 1]]))


def _polyline(x: Array, y: Array) -> str:
    """A short SVG path: steps from point to point in tenths of a pixel; a single point is a dot."""
    points = np.rint(10.0 * np.column_stack([x, y])).astype(int)
    steps = np.diff(points, axis=0)
    start = f"M{points[0, 0] / 10:g} {points[0, 1] / 10:g}"
    return start + "l" + (" ".join(f"{dx / 10:g} {dy / 10:g}" for dx, dy in steps) or "0 0")


def linear_scale(low: float, high: float, start: float, end: float) -> Axis:
    """The map from values between low and high to pixels between start and end."""
    slope = (end - start) / ((high - low) or 1.0)
    return lambda value: start + slope * (value - low)


def _at(axis: Axis, value: float) -> float:
    return float(axis(np.asarray(value)))


def _finite(values: Array) -> Array:
    """The finite values; a single 0 where there are none."""
    kept = values[np.isfinite(values)]
    return kept if len(kept) else np.zeros(1)
