"""Parts of the report's pictures, and the waterfall of the held-out gap.

The pictures are SVG that takes its colours from the page, so that it follows dark screens and
paper. Lengths are pixels of a picture that is WIDTH wide.
"""

from __future__ import annotations

from math import ceil, floor, isfinite, log10
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.report.html.markup import Markup, join, tag
from plant_emulator.diagnosis.wording import number, replace_unprintable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from plant_emulator.diagnosis.report.details import Step

WIDTH = 760.0
LONGEST_LABEL = 33
# The waterfall: plot from LEFT to RIGHT, a row a step.
LEFT, RIGHT, ROW, TOP = 245.0, 585.0, 34.0, 26.0


def picture(height: float, told: str, *content: str) -> Markup:
    """An SVG picture; `told` : its text for readers who do not see it."""
    return tag("svg", *content, viewBox=f"0 0 {WIDTH:g} {height:g}", role="img", aria_label=told)


def text(x: float, y: float, words: str, look: str = "plain") -> Markup:
    """A line of text in a picture."""
    return tag("text", words, x=x, y=y, class_=look)


def line(x1: float, y1: float, x2: float, y2: float, look: str) -> Markup:
    """A straight line."""
    return tag("line", x1=x1, y1=y1, x2=x2, y2=y2, class_=look)


def rectangle(x: float, y: float, width: float, height: float, look: str) -> Markup:
    """A box that extends to the left where its width is negative."""
    return tag("rect", x=min(x, x + width), y=y, width=abs(width), height=height, class_=look)


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round values between two limits, at most `most`, 1, 2 or 5 times a power of ten apart."""
    span = (high - low) / most
    if not isfinite(span) or span <= 0.0:
        return [low]
    power = 10.0 ** floor(log10(span))
    step = next(m * power for m in (1.0, 2.0, 5.0, 10.0, 20.0) if m * power >= span)
    return [k * step for k in range(ceil(low / step - 1e-9), floor(high / step + 1e-9) + 1)]


def tick_label(value: float, values: Sequence[float]) -> str:
    """A tick with as many decimals as distinguish it from its neighbours."""
    step = abs(values[1] - values[0]) if len(values) > 1 else abs(value) or 1.0
    if not 1e-4 <= step < 1e6:
        return f"{value:.1e}"
    return f"{value:.{max(0, -floor(log10(step) + 1e-9))}f}"


def waterfall(steps: Sequence[Step]) -> Markup:
    """The held-out gap after each step in multiples of the noise, with its 95 % interval.

    The axis is logarithmic. The bars start at the noise floor, 1.
    """
    drawn = [s for s in steps if isfinite(s.gap) and s.gap > 0.0 and not _is_floor(s)]
    ends = [e for s in drawn for e in (s.gap, *_interval(s))]
    low, high = 0.92 * min([1.0, *ends]), 1.06 * max([1.8, *ends])

    def x(gap: float) -> float:
        return LEFT + (RIGHT - LEFT) * log10(gap / low) / log10(high / low)

    bottom = TOP + ROW * len(drawn)
    rows = [_step(s, drawn[k - 1] if k else None, TOP + ROW * k, x) for k, s in enumerate(drawn)]
    told = "; ".join(f"{s.label}: {_reading(s)}" for s in drawn)
    return picture(
        bottom + 40.0,
        f"Waterfall of the held-out gap in multiples of the noise. {told}. Noise floor: 1.",
        text(x(1.0), TOP - 10.0, "noise floor", "middle soft"),
        text(RIGHT + 16.0, TOP - 10.0, "gap (95 % interval)", "soft"),
        *(_tick(value, x(value), bottom) for value in _decades(low, high)),
        *rows,
        line(x(1.0), TOP - 4.0, x(1.0), bottom, "floor"),
        text((LEFT + RIGHT) / 2.0, bottom + 34.0, "times the noise, logarithmic", "middle soft"),
    )


def _is_floor(step: Step) -> bool:
    """Whether a step is the noise floor, which is drawn as a line."""
    return step.gap == step.low == step.high == 1.0


def _interval(step: Step) -> tuple[float, ...]:
    return tuple(e for e in (step.low, step.high) if isfinite(e) and e > 0.0)


def _reading(step: Step) -> str:
    ends = " to ".join(number(e) for e in _interval(step))
    return f"{number(step.gap)} ({ends})" if ends else number(step.gap)


def _step(step: Step, before: Step | None, y: float, x: Callable[[float], float]) -> Markup:
    label = replace_unprintable(step.label)
    if len(label) > LONGEST_LABEL:
        label = label[: LONGEST_LABEL - 1] + "\N{HORIZONTAL ELLIPSIS}"
    middle, ends = y + ROW / 2.0, _interval(step)
    parts = [text(LEFT - 12.0, middle + 4.0, label, "end")]
    if before is not None:
        parts.append(rectangle(x(step.gap), y + 8.0, x(before.gap) - x(step.gap), ROW - 16, "gone"))
    parts.append(rectangle(x(1.0), y + 8.0, x(step.gap) - x(1.0), ROW - 16.0, "left"))
    if len(ends) == 2:
        low, high = map(x, ends)
        parts += [line(low, middle, high, middle, "whisker")]
        parts += [line(end, middle - 6.0, end, middle + 6.0, "whisker") for end in (low, high)]
    parts.append(text(RIGHT + 16.0, middle + 4.0, _reading(step), "bold"))
    return join(*parts)


def _decades(low: float, high: float) -> list[float]:
    """1, 2, 5, 10, ... between two limits; only powers of ten between distant limits."""
    powers = range(floor(log10(low)), ceil(log10(high)) + 1)
    factors = (1.0, 2.0, 5.0) if high / low < 1000.0 else (1.0,)
    found = [m * 10.0**k for k in powers for m in factors]
    return [value for value in found if low <= value <= high]


def _tick(value: float, x: float, bottom: float) -> Markup:
    return join(
        line(x, TOP - 4.0, x, bottom, "grid"), text(x, bottom + 16.0, f"{value:g}", "middle soft")
    )
