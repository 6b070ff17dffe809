"""The part of a report on what a machine modelled in outline leaves: power by frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.prediction.remainder import describe_band
from plant_emulator.diagnosis.report.html_parts import bar, cell, right, row_head, table
from plant_emulator.diagnosis.report.html_tables import TIMES
from plant_emulator.diagnosis.report.markup import Markup, join, tag
from plant_emulator.diagnosis.wording import number
from plant_emulator.signals.frequency_bands import BANDS

if TYPE_CHECKING:
    from plant_emulator.diagnosis.prediction.remainder import Remainder


def rest_by_band(rest: Remainder) -> Markup:
    """How much is left, and in which band."""
    words = (
        f"Relative error norm(e)/norm(y) of the held-out {rest.channel}: "
        f"{100.0 * rest.before:.2f} % with parameters re-estimated, {100.0 * rest.after:.2f} % "
        f"with the effects found. Of that, {describe_band(rest)}."
    )
    heads = ["held-out runs", "share"]
    if rest.fitted is not None:
        heads[1:1] = ["fitted runs", "ratio"]
    by_band = table(
        f"Power of the residual by frequency [{rest.unit}^2], with the effects found.",
        ["band [Hz]", *map(right, heads)],
        [_band(rest, k) for k in range(len(BANDS))],
    )
    return join(tag("p", words), by_band)


def _band(rest: Remainder, k: int) -> Markup:
    low, high = BANDS[k]
    power, whole = float(rest.held_out[k]), float(rest.held_out.sum())
    compared = []
    if rest.fitted is not None:
        own = float(rest.fitted[k])
        ratio = f"{power / own:.1f} {TIMES}" if own > 0.0 else ""
        compared = [cell(number(own)), cell(ratio)]
    share = power / whole if whole > 0.0 else 0.0
    return tag(
        "tr",
        row_head(f"{low:g} to {high:g}"),
        cell(number(power)),
        *compared,
        bar(f"{100.0 * share:.0f} %", share),
    )
