"""The residual maps of the report: channel by phase, speed, load, direction, frequency and time."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.localisation.operating_phases import PHASES
from plant_emulator.diagnosis.report.html.markup import Markup, tag
from plant_emulator.diagnosis.report.html.parts import TIMES, right, row_head, table
from plant_emulator.diagnosis.wording import in_words, number, quantity

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from plant_emulator.diagnosis.answer import Cell, Location

# Tints of the cells of a residual map, each from a multiple of the noise on.
HEAT = ((10.0, "heat4"), (5.0, "heat3"), (2.0, "heat2"), (1.2, "heat1"))
# Axes of the residual map beside the phase, in words.
AXES = {
    "speed": "motor speed",
    "load": "load on the drum",
    "direction": "direction",
    "frequency": "frequency",
    "time": "time since the start of the run",
}


def residual_map(location: Location, units: Mapping[str, str]) -> Markup:
    """The residual by channel and phase: in multiples of the noise, and in the channel's unit."""
    cells = location.maps["phase"]
    seen = dict.fromkeys(cell_.bin for cell_ in cells)
    phases = [p for p in PHASES if p in seen] + [p for p in seen if p not in PHASES]
    return _map(
        cells,
        phases,
        units,
        "Residual without effects by channel and phase of operation, in multiples of the noise and "
        "in the channel's unit. Tints begin at 1.2, 2, 5 and 10 times the noise. A frame marks the "
        "place that the answer names.",
        (location.channel, location.phase),
    )


def residual_maps(maps: Mapping[str, Sequence[Cell]], units: Mapping[str, str]) -> Iterator[Markup]:
    """The residual by channel and every axis beside the phase, a table for each axis."""
    for axis, words in AXES.items():
        if axis in maps:
            bins = list(dict.fromkeys(cell_.bin for cell_ in maps[axis]))
            yield _map(maps[axis], bins, units, f"Residual without effects by channel and {words}.")


def _map(
    entries: Sequence[Cell],
    bins: Sequence[str],
    units: Mapping[str, str],
    caption: str,
    here: tuple[str | None, str | None] | None = None,
) -> Markup:
    cells = {(entry.channel, entry.bin): entry for entry in entries}
    channels = list(dict.fromkeys(c for c, _ in cells))
    rows = [
        tag(
            "tr",
            row_head(in_words(channel)),
            *(
                _map_cell(cells.get((channel, name)), units.get(channel), (channel, name) == here)
                for name in bins
            ),
        )
        for channel in channels
    ]
    return table(caption, ["channel", *(right(in_words(name)) for name in bins)], rows, "map")


def _map_cell(found: Cell | None, unit: str | None, here: bool) -> Markup:
    if found is None:
        return tag("td", tag("span", "no samples", class_="soft small"))
    ratio = found.gap / found.noise if isfinite(found.gap) and found.noise else None
    look = next((name for least, name in HEAT if ratio is not None and ratio >= least), "heat0")
    words = f"{ratio:.{0 if ratio >= 100.0 else 1}f} {TIMES}" if ratio is not None else number(None)
    own = tag("span", quantity(found.gap, unit), class_="line soft small")
    return tag("td", words, own, class_=f"{look} here" if here else look)
