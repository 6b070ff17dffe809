"""The answer of a diagnosis as one HTML file that needs nothing else: no network, font or script.

The verdict comes first, then what it rests on: how far the gap shrinks on runs that nothing was
fitted to, where it lies, which effect, what remains open, and how to repeat it all.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.report import html_tables as tables
from plant_emulator.diagnosis.report import html_traces
from plant_emulator.diagnosis.report.html_parts import code, scrolled
from plant_emulator.diagnosis.report.html_pictures import line, waterfall
from plant_emulator.diagnosis.report.html_remainder import rest_by_band
from plant_emulator.diagnosis.report.html_style import STYLE
from plant_emulator.diagnosis.report.markup import Markup, join, tag
from plant_emulator.diagnosis.wording import (
    KINDS,
    UNITS,
    closed,
    indistinguishable,
    logs_used,
    percent,
    place,
    spoken,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.answer import (
        Answer,
        HeldOutGap,
        Location,
        Logs,
        ParameterShift,
        Undetectable,
    )
    from plant_emulator.diagnosis.prediction.remainder import Remainder
    from plant_emulator.diagnosis.prediction.trace import Trace
    from plant_emulator.diagnosis.report.details import Details

# Runs drawn: those with the largest gaps; the others are named.
MOST_RUNS = 8
# No browser loads anything for this page, whatever the names in a log contain.
POLICY = "default-src 'none'; style-src 'unsafe-inline'"
LEGEND = {
    "measured": "measured",
    "before": "predicted before (same equations, parameters re-estimated)",
    "after": "predicted after (with the effects found)",
}


def html(answer: Answer, details: Details) -> str:
    """The report, a whole HTML document."""
    verdict = answer.verdict
    units = {**UNITS, **{t.channel: t.unit for t in details.traces}}
    title = ", ".join([KINDS[verdict.kind], *verdict.effects])
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        Markup(f'<meta http-equiv="Content-Security-Policy" content="{POLICY}"/>'),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", f"Gap between bench and model: {title}"),
        tag("style", Markup(STYLE)),
    )
    body = tag(
        "main",
        _verdict(answer, units),
        _shrinkage(answer.gap, details),
        _location(answer.location, units),
        _rest(details.rest),
        _effects(answer),
        _parameters(verdict.parameters),
        _limits(answer.undetectable),
        _runs(details.traces),
        _repeat(answer.logs, details),
    )
    return f"<!DOCTYPE html>\n{tag('html', head, tag('body', body), lang='en')}\n"


def _section(title: str, *content: str) -> Markup:
    return tag("section", tag("h2", title), *content)


def _verdict(answer: Answer, units: Mapping[str, str]) -> Markup:
    verdict = answer.verdict
    facts = {
        "Effects": ", ".join(verdict.effects),
        "Where": place(answer.location, units),
        "Gap closed on held-out runs": closed(answer.gap),
        "Confidence": _confidence(verdict.confidence),
        "Logs": logs_used(answer.logs),
    }
    told = [join(tag("dt", key), tag("dd", value)) for key, value in facts.items() if value]
    parts = [
        tag("h1", "Gap between bench and model"),
        tag(
            "div",
            tag("p", KINDS[verdict.kind], class_="kind"),
            tag("p", verdict.statement, class_="statement"),
            class_="verdict",
        ),
        tag("dl", *told),
    ]
    if verdict.next_experiment:
        words = tag("p", tag("strong", "Next experiment: "), verdict.next_experiment)
        parts.append(tag("div", words, class_="next"))
    return tag("header", *parts)


def _confidence(share: float | None) -> str | None:
    if share is None:
        return None
    return f"{percent(share)}: so often were answers of this kind right where the truth was known"


def _shrinkage(gap: HeldOutGap, details: Details) -> Markup:
    parts = []
    if details.waterfall:
        caption = (
            "Rms of the whitened residual over all channels of the held-out runs. Filled: what is "
            "left above the noise; dashed: what the step took away; whiskers: 95 % interval from "
            "a block bootstrap."
        )
        drawn = scrolled(waterfall(details.waterfall), "Waterfall")
        parts.append(tag("figure", drawn, tag("figcaption", caption)))
    share = closed(gap)
    if share:
        parts.append(tag("p", tag("strong", f"Closed: {share}"), " of the gap above the noise."))
    if gap.noise_floor:
        parts.append(tables.gap_by_channel(gap, details.traces))
    return _section("How far the gap shrinks", *parts)


def _location(location: Location, units: Mapping[str, str]) -> Markup:
    parts = []
    if location.cells:
        parts.append(tables.residual_map(location, units))
        parts += tables.residual_maps(location.maps, units)
    if location.shares:
        parts.append(tables.subsystems(location))
    return _section("Where it lies", *(parts or [tag("p", "Nothing stands out of the noise.")]))


def _rest(rest: Remainder | None) -> Markup:
    return Markup("") if rest is None else _section("What is left", rest_by_band(rest))


def _effects(answer: Answer) -> Markup:
    if not answer.ranking:
        return _section("Which effect", tag("p", "No effect was worth a test."))
    classes = [
        tag("li", *_class(name, others))
        for name, others in indistinguishable(answer.verdict).items()
    ]
    parts = [tables.ranking(answer.ranking)]
    if classes:
        parts += [tag("h3", "Can another effect look the same?"), tag("ul", *classes)]
    return _section("Which effect", *parts)


def _class(name: str, others: Sequence[str]) -> list[str]:
    if not others:
        return [code(name), ": these logs tell it from every other effect of the library."]
    listed = [part for other in others for part in (", ", code(other))][1:]
    return [code(name), ": these logs cannot tell it from ", *listed, "."]


def _parameters(shifted: Sequence[ParameterShift]) -> Markup:
    none = tag("p", "None lies more than 3 standard errors away from the set.")
    return _section("Parameters that moved", tables.parameters(shifted) if shifted else none)


def _limits(entries: Sequence[Undetectable]) -> Markup:
    none = tag("p", "Every effect of the library would show in these logs.")
    return _section(
        "What these logs cannot show", tables.undetectable(entries) if entries else none
    )


def _runs(traces: Sequence[Trace]) -> Markup:
    runs: dict[str, list[Trace]] = {}
    for trace in traces:
        runs.setdefault(trace.source, []).append(trace)
    largest = sorted(runs, key=lambda name: -_worst(runs[name]))[:MOST_RUNS]
    shown = [name for name in runs if name in largest]
    left_out = [name for name in runs if name not in largest]
    columns = html_traces.columns_of([t for name in shown for t in runs[name]])
    parts = [_legend(traces)] if shown else [tag("p", "No held-out run could be predicted.")]
    for name in shown:
        parts += [tag("h3", name), *(_figure(trace, columns) for trace in runs[name])]
    if left_out:
        parts.append(tag("p", f"Not drawn, with smaller gaps: {', '.join(left_out)}."))
    return _section("Held-out runs, measured over predicted", *parts)


def _worst(run: Sequence[Trace]) -> float:
    """Largest gap of a run over its noise, before [1]."""
    return max(
        html_traces.rms(t.measured - t.recalibrated) / t.noise if t.noise else 0.0 for t in run
    )


def _legend(traces: Sequence[Trace]) -> Markup:
    looks = {"measured", *(look for t in traces for look in html_traces.residuals(t))}
    shown = [
        tag(
            "span",
            tag("svg", line(1.0, 6.0, 41.0, 6.0, look), viewBox="0 0 42 12", aria_hidden="true"),
            f" {words if 'after' in looks else words.replace('before ', '')}",
        )
        for look, words in LEGEND.items()
        if look in looks
    ]
    band = tag(
        "span", "grey band, dotted edges: two standard deviations of the noise to either side"
    )
    return tag("p", *shown, band, class_="legend small")


def _figure(trace: Trace, columns: int) -> Markup:
    name = f"{spoken(trace.channel)} [{trace.unit}]"
    drawn = scrolled(html_traces.draw(trace, columns), name)
    words = tag("figcaption", tag("strong", name), f": {html_traces.summary(trace)}")
    return tag("figure", words, drawn)


def _repeat(logs: Logs, details: Details) -> Markup:
    kinds = {"Fitted": logs.estimation, "Held out": logs.held_out}
    named = {title: ", ".join(names) or "none" for title, names in kinds.items()}
    parts = [tables.named({**named, **details.settings})]
    if details.notes:
        notes = [tag("li", note, class_="any") for note in details.notes]
        parts += [tag("h3", "What was noticed about the logs"), tag("ul", *notes)]
    return _section("To repeat it", *parts)
