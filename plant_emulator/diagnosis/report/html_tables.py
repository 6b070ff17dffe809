"""The tables of the report: gap by channel, residual map, ranking, parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.diagnosis.localisation.operating_phases import PHASES
from plant_emulator.diagnosis.report.html_parts import bar, cell, code, right, row_head, table
from plant_emulator.diagnosis.report.html_traces import residuals, rms
from plant_emulator.diagnosis.report.markup import Markup, join, tag
from plant_emulator.diagnosis.wording import (
    EXPLAINED,
    RESIDUAL,
    number,
    own_name,
    percent,
    quantity,
    share_of,
    size,
    spoken,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from plant_emulator.diagnosis.prediction.trace import Trace

# From which multiple of the noise a cell of the map takes which tint.
HEAT = ((10.0, "heat4"), (5.0, "heat3"), (2.0, "heat2"), (1.2, "heat1"))
# Axes of the residual map but the phase, in words.
AXES = {
    "speed": "the motor's speed",
    "load": "load on the drum",
    "direction": "direction",
    "frequency": "frequency",
    "time": "time since the start of the run",
}
# Half width of a 95 % interval in standard errors.
NORMAL_95 = 1.96
PLUS_MINUS = "\N{PLUS-MINUS SIGN}"
TIMES = "\N{MULTIPLICATION SIGN}"


def gap_by_channel(gap: Mapping[str, Any], traces: Sequence[Trace]) -> Markup:
    """The held-out gap of every channel, in percent of its range and in its own unit."""
    kinds = [k for k in ("nominal", "recalibrated", "explained", "noise_floor") if gap[k]]
    both = any("after" in residuals(t) for t in traces)
    rows = [
        tag(
            "tr",
            row_head(spoken(channel)),
            *(cell(_range_share(gap[k].get(channel))) for k in kinds),
            *(cell(text) for text in _pooled([t for t in traces if t.channel == channel], both)),
        )
        for channel in gap["noise_floor"]
    ]
    rms_of = ["rms before", "rms after"] if both else ["rms"]
    heads = [*(f"{spoken(k)} [%]" for k in kinds), *rms_of, "noise"]
    return table(
        "Held-out runs, all samples of a channel together. Gap in percent of the channel's "
        "measured range; rms of the residual in the channel's unit.",
        ["channel", *map(right, heads)],
        rows,
    )


def _range_share(share: float | None) -> str:
    return number(None) if share is None else f"{100.0 * share:.3f}"


def _pooled(traces: Sequence[Trace], both: bool) -> list[str]:
    """Rms before (and after), and the noise, of a channel over all its runs."""
    if not traces:
        return [""] * (2 + both)
    found = [residuals(t) for t in traces]
    kinds = [[r["before"] for r in found], [r.get("after", r["before"]) for r in found]]
    noise = float(np.sqrt(np.mean([t.noise**2 for t in traces])))
    unit = traces[0].unit
    return [
        *(quantity(rms(np.concatenate(kind)), unit) for kind in kinds[: 1 + both]),
        quantity(noise, unit, 2),
    ]


def residual_map(location: Mapping[str, Any], units: Mapping[str, str]) -> Markup:
    """Channel by phase: the gap over the noise, tinted, and the gap in the channel's unit."""
    seen = dict.fromkeys(c["phase"] for c in location["map"])
    phases = [p for p in PHASES if p in seen] + [p for p in seen if p not in PHASES]
    return _map(
        location["map"],
        "phase",
        phases,
        units,
        "Residual by channel and phase of operation, in multiples of the noise, and in the "
        "channel's unit. Darker tint: from 1.2, 2, 5 and 10 times the noise. Framed: the place "
        "that the answer names.",
        (location["channel"], location["phase"]),
    )


def residual_maps(
    maps: Mapping[str, Sequence[Mapping[str, Any]]], units: Mapping[str, str]
) -> Iterator[Markup]:
    """The same along the other axes."""
    for axis, words in AXES.items():
        if axis in maps:
            bins = list(dict.fromkeys(c[axis] for c in maps[axis]))
            yield _map(maps[axis], axis, bins, units, f"The same by {words}.")


def _map(
    entries: Sequence[Mapping[str, Any]],
    axis: str,
    bins: Sequence[str],
    units: Mapping[str, str],
    caption: str,
    here: tuple[str, str] | None = None,
) -> Markup:
    cells = {(c["channel"], c[axis]): c for c in entries}
    channels = list(dict.fromkeys(c for c, _ in cells))
    rows = [
        tag(
            "tr",
            row_head(spoken(channel)),
            *(
                _map_cell(cells.get((channel, name)), units.get(channel), (channel, name) == here)
                for name in bins
            ),
        )
        for channel in channels
    ]
    return table(caption, ["channel", *(right(spoken(name)) for name in bins)], rows, "map")


def _map_cell(found: Mapping[str, Any] | None, unit: str | None, here: bool) -> Markup:
    if found is None:
        return tag("td", tag("span", "no samples", class_="soft small"))
    gap, noise = found["gap"], found["noise"]
    ratio = gap / noise if gap is not None and noise else None
    look = next((name for least, name in HEAT if ratio is not None and ratio >= least), "heat0")
    words = f"{ratio:.{0 if ratio >= 100.0 else 1}f} {TIMES}" if ratio is not None else number(None)
    own = tag("span", quantity(gap, unit), class_="line soft small")
    return tag("td", words, own, class_=f"{look} here" if here else look)


def subsystems(location: Mapping[str, Any]) -> Markup:
    """Every subsystem's share of the residual."""
    rows = [
        tag("tr", row_head(spoken(s["name"])), bar(percent(s["share"]), s["share"]))
        for s in location["subsystems"]
    ]
    whole = share_of(location)
    told = {
        RESIDUAL: "in the residual, without any hypothesis about the cause",
        EXPLAINED: "in what the best effect of each explains alone",
    }
    return table(
        f"Share of each subsystem {told[whole]}.", ["subsystem", right(f"share {whole}")], rows
    )


def ranking(entries: Sequence[Mapping[str, Any]]) -> Markup:
    """The effects by evidence, each with its parameters and their 95 % intervals."""
    most = max([1e-9, *(e["evidence"] or 0.0 for e in entries)])
    return table(
        "Evidence: fall of the penalised cost, corrected for autocorrelation. Held-out gain: "
        "share of the gap that the effect closes alone on runs it was not fitted to. Standard "
        "error: with that of the effect's law.",
        [
            "effect",
            "subsystem",
            "accepted",
            right("evidence"),
            right("held-out gain"),
            f"parameter: value {PLUS_MINUS} standard error (95 % interval)",
        ],
        [_ranked(entry, most) for entry in entries],
    )


def _ranked(entry: Mapping[str, Any], most: float) -> Markup:
    evidence = entry["evidence"]
    sizes = [
        tag("span", f"{own_name(p['name'], entry['effect'])} ", *_estimate(p), class_="line")
        for p in entry["parameters"]
    ]
    return tag(
        "tr",
        row_head(code(entry["effect"])),
        tag("td", spoken(entry["subsystem"])),
        tag("td", "yes" if entry["accepted"] else "no"),
        bar(number(None) if evidence is None else f"{evidence:.1f}", (evidence or 0.0) / most),
        cell(percent(entry["held_out_gain"])),
        tag("td", *sizes),
        class_="accepted" if entry["accepted"] else "other",
    )


def _estimate(parameter: Mapping[str, Any]) -> list[Markup]:
    """Value with standard error, and the 95 % interval where there is one."""
    value, error = parameter["value"], parameter["standard_error"]
    found = [tag("span", size(parameter, PLUS_MINUS))]
    if value is not None and error and np.isfinite(error):
        low, high = (number(value + k * NORMAL_95 * error, 4) for k in (-1, 1))
        found += [Markup(" "), tag("span", f"({low} to {high})", class_="soft")]
    return found


def parameters(shifted: Sequence[Mapping[str, Any]]) -> Markup:
    """Parameters that the logs put more than 3 standard errors away from the set."""
    rows = [
        tag(
            "tr",
            row_head(code(p["name"])),
            cell(quantity(p["nominal"], p["unit"], 4)),
            cell(size({**p, "value": p["estimated"]}, PLUS_MINUS)),
            cell(_change(p)),
            cell(_distance(p)),
        )
        for p in shifted
    ]
    heads = ["set", f"estimated {PLUS_MINUS} standard error", "change", "standard errors"]
    return table(
        "Parameters that these logs put more than 3 standard errors away from the set.",
        ["parameter", *map(right, heads)],
        rows,
    )


def _change(p: Mapping[str, Any]) -> str:
    return f"{100.0 * (p['estimated'] / p['nominal'] - 1.0):+.1f} %" if p["nominal"] else ""


def _distance(p: Mapping[str, Any]) -> str:
    error = p["standard_error"]
    return number(abs(p["estimated"] - p["nominal"]) / error, 2) if error else number(None)


def undetectable(entries: Sequence[Mapping[str, Any]]) -> Markup:
    """Effects that may be there without these logs showing them."""
    rows = [tag("tr", row_head(code(u["effect"])), tag("td", u["reason"])) for u in entries]
    return table(
        "Effects that these logs cannot show: that they are not named says nothing about them.",
        ["effect", "why, and what would show it"],
        rows,
    )


def named(entries: Mapping[str, str]) -> Markup:
    """Names and what belongs to them."""
    pairs = [
        join(tag("dt", name), tag("dd", value, class_="hash")) for name, value in entries.items()
    ]
    return tag("dl", *pairs)
