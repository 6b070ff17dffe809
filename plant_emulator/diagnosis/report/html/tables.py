"""The tables of the report: held-out gap, shares, ranking, parameters, hidden effects."""

from __future__ import annotations

from math import isfinite, isnan, nan
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.report.html.markup import Markup, join, tag
from plant_emulator.diagnosis.report.html.parts import (
    PLUS_MINUS,
    bar,
    cell,
    code,
    right,
    row_head,
    table,
)
from plant_emulator.diagnosis.report.html.traces import residuals, rms
from plant_emulator.diagnosis.wording import (
    EXPLAINED,
    RESIDUAL,
    UNBROKEN,
    gap_rows,
    in_words,
    number,
    own_name,
    percent,
    quantity,
    share_of,
    size,
)
from plant_emulator.estimation.covariance import NORMAL_95

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.answer import (
        HeldOutGap,
        Location,
        ParameterDeviation,
        Quantity,
        RankedEffect,
        SearchStep,
        SensorNoise,
        Undetectable,
    )
    from plant_emulator.diagnosis.prediction.trace import Trace

# Half width of a 95 % interval in standard errors.


def gap_by_channel(gap: HeldOutGap, traces: Sequence[Trace]) -> Markup:
    """The held-out gap of every channel, in percent of its range and in its unit."""
    steps = gap_rows(gap)
    both = any("after" in residuals(t) for t in traces)
    rows = [
        tag(
            "tr",
            row_head(in_words(channel)),
            *(cell(_range_share(step.get(channel, nan))) for step in steps.values()),
            *(
                cell(text)
                for text in _pooled_texts([t for t in traces if t.channel == channel], both)
            ),
        )
        for channel in gap.noise_floor
    ]
    rms_of = ["rms before", "rms after"] if both else ["rms"]
    heads = [*(f"{name} [%]" for name in steps), *rms_of, "noise"]
    return table(
        "Held-out gap of every channel over all samples of all runs, in percent of the channel's "
        "measured range (NRMSD). Rms of the residual before and after the effects, and noise, in "
        "the channel's unit.",
        ["channel", *map(right, heads)],
        rows,
    )


def _range_share(share: float) -> str:
    return number(share) if isnan(share) else f"{100.0 * share:.3f}"


def _pooled_texts(traces: Sequence[Trace], both: bool) -> list[str]:
    """Rms before the effects, rms after where `both`, and noise of a channel over its runs."""
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


def subsystems(location: Location) -> Markup:
    """The share of every subsystem in the residual, or in what the effects explain."""
    rows = [
        tag("tr", row_head(in_words(name)), bar(percent(share), share))
        for name, share in location.shares.items()
    ]
    whole = share_of(location)
    told = {
        RESIDUAL: "in the residual, found without a hypothesis about the cause",
        EXPLAINED: "in what its best effect explains alone",
    }
    return table(
        f"Share of each subsystem {told[whole]}.",
        ["subsystem", right(f"share {whole}")],
        rows,
        "short",
    )


def ranking(entries: Sequence[RankedEffect]) -> Markup:
    """The tested effects by evidence, with their parameters and 95 % intervals."""
    most = max([1e-9, *(e.evidence for e in entries if isfinite(e.evidence))])
    return table(
        "Evidence: fall of the penalised sum of squares, corrected for autocorrelation. Held-out "
        "gain: share of the gap that the effect alone closes on runs it was not fitted to. The "
        "standard error includes the model-form errors of the effects' laws.",
        [
            "effect",
            "subsystem",
            "accepted",
            right("evidence"),
            right("held-out gain"),
            f"parameter: value {PLUS_MINUS} standard error (95{UNBROKEN}% interval)",
        ],
        [_ranking_row(entry, most) for entry in entries],
    )


def _ranking_row(entry: RankedEffect, most: float) -> Markup:
    known = isfinite(entry.evidence)
    evidence = f"{entry.evidence:.1f}" if known else number(None)
    sizes = [
        tag("span", f"{own_name(p.name, entry.effect)} ", *_estimate(p), class_="line")
        for p in entry.parameters
    ]
    return tag(
        "tr",
        row_head(code(entry.effect)),
        tag("td", in_words(entry.subsystem)),
        tag("td", "yes" if entry.accepted else "no"),
        bar(evidence, entry.evidence / most if known else 0.0),
        cell("not computed" if entry.held_out_gain is None else percent(entry.held_out_gain)),
        tag("td", *sizes),
        class_="accepted" if entry.accepted else "other",
    )


def _estimate(estimated: Quantity) -> list[Markup]:
    """A value with its standard error, and its 95 % interval where it has one."""
    value, error = estimated.value, estimated.standard_error
    found = [tag("span", size(estimated, PLUS_MINUS))]
    if isfinite(value) and error and isfinite(error):
        low, high = (number(value + k * NORMAL_95 * error, 4) for k in (-1, 1))
        found += [Markup(" "), tag("span", f"({low} to {high})", class_="soft")]
    return found


def parameters(deviations: Sequence[ParameterDeviation]) -> Markup:
    """The parameters that lie more than 3 standard errors from the set."""
    rows = [
        tag(
            "tr",
            row_head(code(p.name)),
            cell(quantity(p.nominal, p.unit, 4)),
            cell(size(p.quantity, PLUS_MINUS)),
            cell(_change(p)),
            cell(_distance(p)),
        )
        for p in deviations
    ]
    heads = [
        "set",
        f"estimated {PLUS_MINUS} standard error",
        "change",
        "deviation in standard errors",
    ]
    return table(
        "Parameters that lie more than 3 standard errors from the parameter set.",
        ["parameter", *map(right, heads)],
        rows,
    )


def _change(p: ParameterDeviation) -> str:
    return f"{100.0 * (p.estimated / p.nominal - 1.0):+.1f} %" if p.nominal else ""


def _distance(p: ParameterDeviation) -> str:
    error = p.standard_error
    return number(abs(p.estimated - p.nominal) / error, 2) if error else number(None)


def undetectable(entries: Sequence[Undetectable]) -> Markup:
    """The effects that may be there although these logs do not show them."""
    rows = [tag("tr", row_head(code(u.effect)), tag("td", u.reason)) for u in entries]
    return table(
        "Effects that these logs cannot show at their plausible size. Such an effect may be there "
        "although the verdict does not name it.",
        ["effect", "reason, and what would show it"],
        rows,
    )


def search_steps(steps: Sequence[SearchStep]) -> Markup:
    """Table of the hypotheses that the search tried, in its order."""
    rows = [
        tag(
            "tr",
            tag("td", step.action),
            row_head(*_effect_names(step.effects)),
            cell(", ".join(f"{gain:.0f} ({name})" for name, gain in step.promised.items())),
            cell(number(step.gain)),
            cell(number(step.mean_square, 4)),
        )
        for step in steps
    ]
    heads = ["promised gain", "gain", "mean square left"]
    return table(
        "The search in its order. Gains are of log evidence: those that the linear regressions "
        "promise for the last effect, and that of the fit over the fit without effects, or of a "
        "fit that is led along the measured speeds over such a fit without its last effect. A mean "
        "square of 1 is noise.",
        ["step", "effects", *map(right, heads)],
        rows,
    )


def _effect_names(effects: Sequence[str]) -> list[str]:
    names = [part for name in effects for part in (" + ", code(name))][1:]
    return names or ["no effect"]


def sensor_noise(channels: Sequence[SensorNoise]) -> Markup:
    """The noise of every channel as the logs show it."""
    rows = [
        tag(
            "tr",
            row_head(in_words(one.channel)),
            cell(number(one.deviation)),
            cell(f"{1e3 * one.correlation_time:.0f} ms"),
            tag("td", ", ".join(f"{f:.2f} Hz" for f in one.lines) or "none"),
            cell(f"{100.0 * one.outliers:.2f} %"),
            cell(f"{1e3 * one.held_period:.0f} ms" if one.held_period else "no"),
            tag("td", "yes" if one.white else "no"),
        )
        for one in channels
    ]
    heads = ["standard deviation [SI]", "correlation time"]
    return table(
        "Noise of the channels. White: whether the innovations of the noise model are white; where "
        "they are not, the model does not explain the noise.",
        ["channel", *map(right, heads), "hum", right("outliers"), right("held"), "white"],
        rows,
    )


def definition_list(entries: Mapping[str, str]) -> Markup:
    """A list of names, each with its text."""
    pairs = [
        join(tag("dt", name), tag("dd", value, class_="hash")) for name, value in entries.items()
    ]
    return tag("dl", *pairs)
