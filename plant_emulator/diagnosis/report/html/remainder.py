"""The unmodelled remainder in a report: its power by frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.prediction.remainder import describe_band
from plant_emulator.diagnosis.report.html.markup import Markup, join, tag
from plant_emulator.diagnosis.report.html.parts import TIMES, bar, cell, right, row_head, table
from plant_emulator.diagnosis.wording import number
from plant_emulator.signals.frequency_bands import BANDS

if TYPE_CHECKING:
    from plant_emulator.diagnosis.prediction.remainder import Remainder


def remainder_by_band(remainder: Remainder) -> Markup:
    """Table of the unmodelled remainder of a machine in outline, by frequency band."""
    before, after = 100.0 * remainder.before, 100.0 * remainder.after
    words = (
        f"Relative error norm(e)/norm(y) of the held-out {remainder.channel}: {before:.2f} % with "
        f"re-estimated parameters, {after:.2f} % with the accepted effects. Of that, "
        f"{describe_band(remainder)}."
    )
    heads = ["held-out runs", "share"]
    if remainder.fitted is not None:
        heads[1:1] = ["fitted runs", "ratio"]
    by_band = table(
        f"Power of the residual by frequency [{remainder.unit}^2], with the accepted effects.",
        ["band [Hz]", *map(right, heads)],
        [_band(remainder, k) for k in range(len(BANDS))],
    )
    return join(tag("p", words), by_band)


def _band(remainder: Remainder, k: int) -> Markup:
    low, high = BANDS[k]
    power, whole = float(remainder.held_out[k]), float(remainder.held_out.sum())
    compared = []
    if remainder.fitted is not None:
        own = float(remainder.fitted[k])
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
