"""The answer of a diagnosis on one screen: statement, place, ranking, shrinkage, what is next.

Plain text without colours, so that it reads the same in a terminal, a file and a mail. What does
not fit is counted ("and 3 more"): the whole stands in the JSON answer and in the report.
"""

from __future__ import annotations

import re
from math import isfinite, isnan, nan
from textwrap import wrap
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.wording import (
    EXPLAINED_GAP,
    KINDS,
    UNITS,
    closed,
    gap_rows,
    indistinguishable,
    logs_used,
    number,
    own_name,
    percent,
    place,
    printable,
    shifted,
    size,
    times_noise,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.answer import Answer, HeldOutGap, RankedEffect, Undetectable

# A screen has 24 lines; the last is the prompt's.
HEIGHT = 23
MOST_RANKED = 6
# Columns of the table of the gap that leave its bars some room.
MOST_CHANNELS = 5
NAME, CELL = 29, 9
LABEL = 13
EVIDENCE_DECIMALS = 1
# Lines of the statement, and with effects that have much to tell beside them.
STATEMENT, LEAST_STATEMENT = 4, 3
# Runners-up beyond so many give way to the empty lines between the sections.
LEAST_OTHERS = 2
# Spaces within "2.83 N m" at which no line ends.
WITHIN_QUANTITY = re.compile(r"(?<=\d) (?=[%A-Za-z])|(?<=[\d ]N) (?=m\b)|(?<=kg) (?=m\^2)")
UNBROKEN = "\N{NO-BREAK SPACE}"


def lines(answer: Answer, width: int = 80) -> list[str]:
    """The answer for a terminal of this width and 24 lines."""
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
    """Text in at most so many lines behind a label, cut at a word with three dots."""
    first = f"{label:9}" if label else ""
    rows = wrap(
        WITHIN_QUANTITY.sub(UNBROKEN, printable(text)),
        width,
        initial_indent=first,
        subsequent_indent=" " * len(first),
        max_lines=most,
        placeholder=" ...",
    )
    return [row.replace(UNBROKEN, " ") for row in rows]


def _listed(
    items: Sequence[str], width: int, most: int, label: str, names: Sequence[str] = ()
) -> list[str]:
    """As many items as fit, and the number of those that do not; their names where none fits."""
    for shown in range(len(items), 0, -1):
        more = f"; and {len(items) - shown} more" if shown < len(items) else ""
        rows = _paragraph("; ".join(items[:shown]) + more, width, 99, label)
        if len(rows) <= most:
            return rows
    if names:
        return _listed(names, width, most, label)
    return _paragraph("; ".join(items), width, most, label) if items else []


def _verdict(answer: Answer, width: int, most: int = STATEMENT) -> list[str]:
    verdict = answer.verdict
    parts = [KINDS[verdict.kind].upper()]
    if verdict.confidence is not None:
        parts.append(f"confidence {percent(verdict.confidence)}")
    parts.append(logs_used(answer.logs))
    where = place(answer.location, UNITS)
    return [
        ", ".join(parts),
        *_paragraph(verdict.statement, width, most),
        *(_paragraph(where, width, 2, "where") if where else []),
    ]


def _ranking(answer: Answer, room: int, width: int) -> list[str]:
    """Head of the ranking, and the accepted effects with what there is room for."""
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
    """The effects that were not accepted, a line each, but for those whose evidence reads 0.0."""
    accepted = sum(r.accepted for r in ranking)
    counting = [r for r in ranking if not round(r.evidence, EVIDENCE_DECIMALS) <= 0.0]
    others = [_row(r) for r in counting if not r.accepted]
    return others[: max(0, MOST_RANKED - accepted)]


def _row(entry: RankedEffect) -> str:
    """Effect, evidence, share of the held-out gap that it closes alone, its first size."""
    mark = "*" if entry.accepted else " "
    gain = "" if entry.held_out_gain is None else percent(entry.held_out_gain)
    evidence = f"{entry.evidence:.{EVIDENCE_DECIMALS}f}" if isfinite(entry.evidence) else ""
    first = size(entry.parameters[0]) if entry.parameters else ""
    name = printable(entry.effect)[: NAME - 2]
    return f"{mark} {name:{NAME - 2}}{evidence:>{CELL}}{gain:>7}  {first}"


def _beside(entry: RankedEffect, others: Sequence[str], width: int) -> list[str]:
    """Further parameters of an accepted effect, and what cannot be told from it."""
    more = [f"{own_name(p.name, entry.effect)} {size(p)}" for p in entry.parameters[1:]]
    alike = [f"not told from {others[0]}", *others[1:]] if others else []
    return _listed(more, width, 1, "  with") + _listed(alike, width, 1, "  class")


def _shrinkage(gap: HeldOutGap, width: int) -> list[str]:
    """The held-out gap in the noise as bars, and in percent of every channel's range."""
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
    share = closed(gap)
    return drawn + ([f"closed: {share}"] if share else [])


def _range_share(share: float) -> str:
    return "" if isnan(share) else f"{100.0 * share:.2f} %"


def _short(channels: Sequence[str]) -> list[str]:
    """One word a channel: its last, or its first where others end alike."""
    last = [name.rpartition("_")[2] for name in channels]
    return [
        printable(end if last.count(end) == 1 else name.partition("_")[0])[: CELL - 1]
        for name, end in zip(channels, last, strict=True)
    ]


def _rest(answer: Answer, width: int) -> list[str]:
    """Parameters that moved, effects that these logs cannot show, the next experiment."""
    verdict = answer.verdict
    moved = [shifted(p) for p in verdict.parameters]
    names = [p.name for p in verdict.parameters]
    rows = _listed(moved, width, 2 if verdict.kind == "parameter" else 1, "moved", names)
    rows += _unseen(answer.undetectable, width, 1 if len(verdict.effects) > 1 else 2)
    return rows + _paragraph(verdict.next_experiment or "", width, 3, "next")


def _unseen(hidden: Sequence[Undetectable], width: int, most: int) -> list[str]:
    """Effects that these logs cannot show, each with its reason if there is room for all."""
    reasons = "; ".join(f"{u.effect} ({u.reason})" for u in hidden)
    rows = _paragraph(reasons, width, most + 1, "unseen") if hidden else []
    if len(rows) <= most:
        return rows
    return _listed([u.effect for u in hidden], width, most, "unseen")
