"""The answer of a diagnosis on one screen: verdict, place, ranking, held-out gap, next experiment.

The text has no colours, so that it reads alike in a terminal, a file and a mail. The screen counts
what does not fit ("and 3 more"); the JSON answer and the report are complete.
"""

from __future__ import annotations

import re
from math import isfinite, isnan, nan
from textwrap import wrap
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.wording import (
    EXPLAINED_GAP,
    KINDS,
    UNBROKEN,
    UNITS,
    closed_share,
    describe_deviation,
    describe_draft_gain,
    describe_location,
    gap_rows,
    indistinguishable,
    logs_used,
    number,
    own_name,
    percent,
    replace_unprintable,
    size,
    times_noise,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.answer import (
        Answer,
        Draft,
        HeldOutGap,
        RankedEffect,
        Undetectable,
    )

# Lines of a screen of 24 lines whose last line holds the prompt.
HEIGHT = 23
MOST_RANKED = 6
# Channels in the table of the gap, so that its bars have some room.
MOST_CHANNELS = 5
NAME, CELL = 29, 9
LABEL = 13
EVIDENCE_DECIMALS = 1
# Most lines of the statement; the second number where the ranking lacks room.
STATEMENT, LEAST_STATEMENT = 4, 3
# Least number of other effects to show before the sections are parted by empty lines.
LEAST_OTHERS = 2
# Spaces within a quantity such as "2.83 N m", at which no line may end.
WITHIN_QUANTITY = re.compile(r"(?<=\d) (?=[%A-Za-z])|(?<=[\d ]N) (?=m\b)|(?<=kg) (?=m\^2)")


def lines(answer: Answer, width: int = 80) -> list[str]:
    """The lines of the answer for a terminal of 24 lines, each at most `width` characters."""
    head = _verdict(answer, width)
    shrinkage = _shrinkage(answer.gap, width)
    rest = _rest(answer, width)
    room = HEIGHT - len(head) - len(shrinkage) - len(rest)
    if len(_ranking(answer, room, width)) < len(_ranking(answer, HEIGHT, width)):
        head = _verdict(answer, width, LEAST_STATEMENT)
        room = HEIGHT - len(head) - len(shrinkage) - len(rest)
    ranking, others = _ranking(answer, room, width), _runners_up(answer.ranking)
    room -= len(ranking)
    breaks = sum(map(bool, (ranking, shrinkage, rest)))
    spaced = room - breaks >= min(len(others), LEAST_OTHERS)
    ranking += others[: max(0, room - breaks if spaced else room)]
    sections = [part for part in (head, ranking, shrinkage, rest) if part]
    rows = [
        row for part in sections for row in ([""] if spaced and part is not head else []) + part
    ]
    return [row[:width].rstrip() for row in rows]


def _paragraph(text: str, width: int, most: int, label: str = "") -> list[str]:
    """A text behind a label in at most `most` lines; three dots end a text that is cut."""
    first = f"{label:9}" if label else ""
    rows = wrap(
        WITHIN_QUANTITY.sub(UNBROKEN, replace_unprintable(text)),
        width,
        initial_indent=first,
        subsequent_indent=" " * len(first),
        max_lines=most,
        placeholder=" ...",
    )
    return [row.replace(UNBROKEN, " ") for row in rows]


def _list_items(
    items: Sequence[str], width: int, most: int, label: str, names: Sequence[str] = ()
) -> list[str]:
    """List as many items as fit into `most` lines, and the number of the others.

    names : shorter forms of the items, for the case that not even the first item fits
    """
    for shown in range(len(items), 0, -1):
        more = f"; and {len(items) - shown} more" if shown < len(items) else ""
        rows = _paragraph("; ".join(items[:shown]) + more, width, 99, label)
        if len(rows) <= most:
            return rows
    if names:
        return _list_items(names, width, most, label)
    return _paragraph("; ".join(items), width, most, label) if items else []


def _verdict(answer: Answer, width: int, most: int = STATEMENT) -> list[str]:
    verdict = answer.verdict
    parts = [KINDS[verdict.kind].upper()]
    if verdict.confidence is not None:
        parts.append(f"confidence {percent(verdict.confidence)}")
    parts.append(logs_used(answer.logs))
    where = describe_location(answer.location, UNITS)
    return [
        ", ".join(parts),
        *_paragraph(verdict.statement, width, most),
        *(_paragraph(where, width, 2, "where") if where else []),
    ]


def _ranking(answer: Answer, room: int, width: int) -> list[str]:
    """The head of the ranking, and the accepted effects with as many details as there is room."""
    accepted = [r for r in answer.ranking if r.accepted]
    if not accepted and not _runners_up(answer.ranking):
        return []
    classes = indistinguishable(answer.verdict)
    room -= 1 + len(accepted)
    rows = [f"{'  effect':{NAME}}{'evidence':>{CELL}}{'gain':>7}  size +- standard error"]
    for entry in accepted:
        beside = _beside(entry, classes.get(entry.effect, ()), width)[: max(0, room)]
        rows += [_row(entry), *beside]
        room -= len(beside)
    return rows


def _runners_up(ranking: Sequence[RankedEffect]) -> list[str]:
    """A line for every effect that was not accepted and whose evidence is not written as 0.0."""
    accepted = sum(r.accepted for r in ranking)
    counting = [r for r in ranking if not round(r.evidence, EVIDENCE_DECIMALS) <= 0.0]
    others = [_row(r) for r in counting if not r.accepted]
    return others[: max(0, MOST_RANKED - accepted)]


def _row(entry: RankedEffect) -> str:
    """A line of the ranking: effect, evidence, held-out gain and first size."""
    mark = "*" if entry.accepted else " "
    gain = "" if entry.held_out_gain is None else percent(entry.held_out_gain)
    evidence = f"{entry.evidence:.{EVIDENCE_DECIMALS}f}" if isfinite(entry.evidence) else ""
    first = size(entry.parameters[0]) if entry.parameters else ""
    name = replace_unprintable(entry.effect)[: NAME - 2]
    return f"{mark} {name:{NAME - 2}}{evidence:>{CELL}}{gain:>7}  {first}"


def _beside(entry: RankedEffect, others: Sequence[str], width: int) -> list[str]:
    """Other parameters of an accepted effect, and effects that are not separable from it."""
    more = [f"{own_name(p.name, entry.effect)} {size(p)}" for p in entry.parameters[1:]]
    alike = [f"not separable from {others[0]}", *others[1:]] if others else []
    return _list_items(more, width, 1, "  with") + _list_items(alike, width, 1, "  class")


def _shrinkage(gap: HeldOutGap, width: int) -> list[str]:
    """The held-out gap: bars in multiples of the noise, and percent of each channel's range."""
    floor = gap.noise_floor
    rows = gap_rows(gap)
    if gap.explained == gap.recalibrated:
        rows.pop(EXPLAINED_GAP, None)
    times = {name: times_noise(row, floor) for name, row in rows.items()}
    most = max((t for t in times.values() if t is not None), default=None)
    if most is None:
        return []
    channels = list(floor)[:MOST_CHANNELS]
    bar = width - LABEL - 7 - CELL * len(channels)
    title = "held-out gap over noise, % of range"
    head = "".join(f"{name:>{CELL}}" for name in _short(channels))
    drawn = [f"{title:{width - len(head)}}{head}"]
    for name, row in rows.items():
        ratio = times[name]
        marks = "#" * max(1, round(bar * (ratio or 0.0) / most))
        cells = "".join(f"{_range_share(row.get(c, nan)):>{CELL}}" for c in channels)
        drawn.append(f"{name:{LABEL}}{number(ratio):>5} {marks:{bar + 1}}{cells}")
    share = closed_share(gap)
    return drawn + ([f"closed: {share}"] if share else [])


def _range_share(share: float) -> str:
    return "" if isnan(share) else f"{100.0 * share:.2f} %"


def _short(channels: Sequence[str]) -> list[str]:
    """One word for each channel: its last word, or its first where two channels end alike."""
    last = [name.rpartition("_")[2] for name in channels]
    return [
        replace_unprintable(end if last.count(end) == 1 else name.partition("_")[0])[: CELL - 1]
        for name, end in zip(channels, last, strict=True)
    ]


def _rest(answer: Answer, width: int) -> list[str]:
    """Parameter deviations, effects that these logs cannot show, and the next experiment."""
    verdict = answer.verdict
    deviations = [describe_deviation(p) for p in verdict.parameters]
    names = [p.name for p in verdict.parameters]
    rows = _list_items(
        deviations, width, 2 if verdict.kind == "parameter" else 1, "deviates", names
    )
    rows += _list_unseen(answer.undetectable, width, 1 if len(verdict.effects) > 1 else 2)
    rows += _list_draft(answer.drafts, width)
    return rows + _paragraph(verdict.next_experiment or "", width, 3, "next")


def _list_draft(found: Sequence[Draft] | None, width: int) -> list[str]:
    """The best draft of a missing law, in three lines."""
    if found is None:
        return []
    if not found:
        return _paragraph("no law over the measured states closes the gap", width, 1, "draft")
    best, *others = found
    told = [f"{best.quantity}: {best.form}", describe_draft_gain(best), f"file {best.file}"]
    if others:
        told[-1] = f"alternatives {'; '.join(one.form for one in others)}; {told[-1]}"
    first, *rest = [row for words in told for row in _paragraph(words, width - 9, 1)]
    return [f"{'draft':9}{first}", *(f"{'':9}{row}" for row in rest)]


def _list_unseen(hidden: Sequence[Undetectable], width: int, most: int) -> list[str]:
    """Effects that these logs cannot show, with their reasons where all of them fit."""
    reasons = "; ".join(f"{u.effect} ({u.reason})" for u in hidden)
    rows = _paragraph(reasons, width, most + 1, "unseen") if hidden else []
    if len(rows) <= most:
        return rows
    return _list_items([u.effect for u in hidden], width, most, "unseen")
