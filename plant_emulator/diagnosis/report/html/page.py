"""The report of a diagnosis: one HTML file that needs no network, no font and no script.

The verdict comes first. Then follow the held-out gap, the place of the gap, the tested effects, the
parameter deviations, what the logs cannot show, the held-out runs, the search with the noise of the
channels, and how to repeat the diagnosis.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.report.html import maps, tables
from plant_emulator.diagnosis.report.html.drafts import drafts
from plant_emulator.diagnosis.report.html.inputs import estimated_inputs
from plant_emulator.diagnosis.report.html.markup import Markup, join, tag
from plant_emulator.diagnosis.report.html.parts import PLUS_MINUS, code, scroll_region
from plant_emulator.diagnosis.report.html.pictures import line, waterfall
from plant_emulator.diagnosis.report.html.remainder import remainder_by_band
from plant_emulator.diagnosis.report.html.spectra import noise_spectra
from plant_emulator.diagnosis.report.html.style import STYLE
from plant_emulator.diagnosis.report.html.traces import columns_of, draw, residuals, rms, summary
from plant_emulator.diagnosis.wording import (
    KINDS,
    UNITS,
    closed_share,
    describe_location,
    in_words,
    indistinguishable,
    logs_used,
    percent,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.answer import (
        Answer,
        Draft,
        HeldOutGap,
        Location,
        Logs,
        ParameterDeviation,
        Undetectable,
    )
    from plant_emulator.diagnosis.noise.spectra import Spectrum
    from plant_emulator.diagnosis.prediction.remainder import Remainder
    from plant_emulator.diagnosis.prediction.trace import Trace
    from plant_emulator.diagnosis.report.details import Details, EstimatedInput

HEADING = "Sim-to-real gap"
# Held-out runs that are drawn: those with the largest gaps. The others are named.
MOST_RUNS = 8
# No browser loads anything for this page, whatever a log's names contain.
POLICY = "default-src 'none'; style-src 'unsafe-inline'"
LEGEND = {
    "measured": "measured",
    "before": "predicted before (same equations, parameters re-estimated)",
    "after": "predicted after (with the accepted effects)",
}


def html(answer: Answer, details: Details) -> str:
    """The report as a complete HTML document."""
    verdict = answer.verdict
    units = {**UNITS, **{t.channel: t.unit for t in details.traces}}
    title = ", ".join([KINDS[verdict.kind], *verdict.effects])
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        Markup(f'<meta http-equiv="Content-Security-Policy" content="{POLICY}"/>'),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", f"{HEADING}: {title}"),
        tag("style", Markup(STYLE)),
    )
    body = tag(
        "main",
        _verdict(answer, units),
        _shrinkage(answer.gap, details),
        _location(answer.location, units),
        _remainder(details.remainder),
        _effects(answer),
        _drafts(answer.drafts, details.draft_traces),
        _parameters(verdict.parameters),
        _limits(answer.undetectable),
        _runs(details.traces),
        _inputs(details.inputs),
        _search(answer, details.spectra),
        _repeat(answer.logs, details),
    )
    return f"<!DOCTYPE html>\n{tag('html', head, tag('body', body), lang='en')}\n"


def _section(title: str, *content: str) -> Markup:
    return tag("section", tag("h2", title), *content)


def _verdict(answer: Answer, units: Mapping[str, str]) -> Markup:
    verdict = answer.verdict
    facts = {
        "Effects": ", ".join(verdict.effects),
        "Where": describe_location(answer.location, units),
        "Gap closed on held-out runs": closed_share(answer.gap),
        "Confidence": _confidence(verdict.confidence),
        "Logs": logs_used(answer.logs),
    }
    told = [join(tag("dt", key), tag("dd", value)) for key, value in facts.items() if value]
    parts = [
        tag("h1", HEADING),
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


def _confidence(probability: float | None) -> str | None:
    if probability is None:
        return None
    return f"{percent(probability)}: probability that it is right, by trials of known truth"


def _shrinkage(gap: HeldOutGap, details: Details) -> Markup:
    parts = []
    if details.waterfall:
        caption = (
            "Rms of the whitened residual over all channels of the held-out runs. Filled bar: gap "
            "above the noise. Dashed box: gap that this step removed. Whiskers: 95 % interval "
            "(block bootstrap)."
        )
        drawn = scroll_region(waterfall(details.waterfall), "Waterfall")
        parts.append(tag("figure", drawn, tag("figcaption", caption)))
    share = closed_share(gap)
    if share:
        parts.append(tag("p", tag("strong", f"Closed: {share}"), " of the gap above the noise."))
    if gap.noise_floor:
        parts.append(tables.gap_by_channel(gap, details.traces))
    return _section("How far the gap shrinks", *parts)


def _location(location: Location, units: Mapping[str, str]) -> Markup:
    parts = []
    if location.cells:
        parts.append(maps.residual_map(location, units))
        parts += maps.residual_maps(location.maps, units)
    if location.shares:
        parts.append(tables.subsystems(location))
    return _section("Where the gap lies", *(parts or [tag("p", "No residual exceeds the noise.")]))


def _remainder(remainder: Remainder | None) -> Markup:
    if remainder is None:
        return Markup("")
    return _section("Unmodelled remainder", remainder_by_band(remainder))


def _effects(answer: Answer) -> Markup:
    if not answer.ranking:
        return _section("Which effects were tested", tag("p", "No effect was tested."))
    classes = [
        tag("li", *_class(name, others))
        for name, others in indistinguishable(answer.verdict).items()
    ]
    parts = [tables.ranking(answer.ranking)]
    if classes:
        parts += [tag("h3", "Are the effects distinguishable?"), tag("ul", *classes)]
    return _section("Which effects were tested", *parts)


def _class(name: str, others: Sequence[str]) -> list[str]:
    if not others:
        return [code(name), ": these logs distinguish it from every other effect of the library."]
    listed = [part for other in others for part in (", ", code(other))][1:]
    return [code(name), ": these logs cannot distinguish it from ", *listed, "."]


def _drafts(found: Sequence[Draft] | None, traces: Sequence[Trace]) -> Markup:
    if found is None:
        return Markup("")
    return _section("The missing law, drafted", drafts(found, traces))


def _parameters(deviations: Sequence[ParameterDeviation]) -> Markup:
    none = tag("p", "No parameter lies more than 3 standard errors from the set.")
    return _section("Parameter deviations", tables.parameters(deviations) if deviations else none)


def _limits(entries: Sequence[Undetectable]) -> Markup:
    none = tag("p", "These logs would show every effect of the library at its plausible size.")
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
    columns = columns_of([t for name in shown for t in runs[name]])
    parts = [_legend(traces)] if shown else [tag("p", "No held-out run could be predicted.")]
    for name in shown:
        parts += [tag("h3", name), *(_figure(trace, columns) for trace in runs[name])]
    if left_out:
        parts.append(tag("p", f"Not drawn, with smaller gaps: {', '.join(left_out)}."))
    return _section("Held-out runs: measured and predicted", *parts)


def _inputs(inputs: Sequence[EstimatedInput]) -> Markup:
    if not inputs:
        return Markup("")
    return _section("Inputs that nobody measured", estimated_inputs(inputs))


def _worst(run: Sequence[Trace]) -> float:
    """The largest gap of a run over its noise [1], before the effects."""
    return max(rms(t.measured - t.recalibrated) / t.noise if t.noise else 0.0 for t in run)


def _legend(traces: Sequence[Trace]) -> Markup:
    looks = {"measured", *(look for t in traces for look in residuals(t))}
    shown = [
        tag(
            "span",
            tag("svg", line(1.0, 6.0, 41.0, 6.0, look), viewBox="0 0 42 12", aria_hidden="true"),
            f" {words if 'after' in looks else words.replace('before ', '')}",
        )
        for look, words in LEGEND.items()
        if look in looks
    ]
    band = tag("span", f"grey band: {PLUS_MINUS} 2 standard deviations of the noise")
    return tag("p", *shown, band, class_="legend small")


def _figure(trace: Trace, columns: int) -> Markup:
    name = f"{in_words(trace.channel)} [{trace.unit}]"
    drawn = scroll_region(draw(trace, columns), name)
    words = tag("figcaption", tag("strong", name), f": {summary(trace)}")
    return tag("figure", words, drawn)


def _search(answer: Answer, spectra: Sequence[Spectrum]) -> Markup:
    if not answer.trace and not answer.noise:
        return Markup("")
    tried = tables.search_steps(answer.trace) if answer.trace else tag("p", "No effect was fitted.")
    noise = [tables.sensor_noise(answer.noise)] if answer.noise else []
    return _section("How the answer was found", tried, *noise, noise_spectra(spectra))


def _repeat(logs: Logs, details: Details) -> Markup:
    kinds = {"Fitted": logs.estimation, "Held out": logs.held_out}
    named = {title: ", ".join(names) or "none" for title, names in kinds.items()}
    parts = [tables.definition_list({**named, **details.settings})]
    if details.notes:
        notes = [tag("li", note, class_="any") for note in details.notes]
        parts += [tag("h3", "Notes on the logs"), tag("ul", *notes)]
    return _section("How to repeat this diagnosis", *parts)
