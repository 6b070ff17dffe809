"""The cases as a table for a spreadsheet, and the pairs that calibrate the confidence."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

COLUMNS = (
    "case", "kind", "truth", "norm", "detectable", "programs", "verdict", "answered", "class",
    "evidence", "confidence", "right", "first_name", "false_alarm", "true_place", "place",
    "located", "closed_fraction", "closed_fraction_true", "seconds", "error",
)  # fmt: skip


def row(one: Mapping[str, Any]) -> list[Any]:
    """One case by COLUMNS."""
    hidden = one["hidden"]
    return [
        one["case"],
        one["kind"],
        one["truth"],
        " ".join(f"{h['norm']:.1f}" for h in hidden),
        one["detectable"],
        " ".join(one["programs"]),
        one["verdict"],
        one["answered"],
        " | ".join(" ".join(names) for names in one["class"]),
        one["evidence"],
        one["confidence"],
        one["right"],
        one["top1"],
        one["false_alarm"],
        " ".join(h["subsystem"] for h in hidden),
        one["subsystem"],
        one["located"],
        one["closed_fraction"],
        one["closed_fraction_true"],
        one["seconds"],
        one["error"],
    ]


def cases(details: Sequence[Mapping[str, Any]]) -> str:
    """All cases as CSV."""
    return _text(COLUMNS, [row(one) for one in details])


def evidence(details: Sequence[Mapping[str, Any]]) -> str:
    """Kind of verdict, evidence and whether it is right, of every case with an answer, as CSV."""
    rows = [
        [one["verdict"], one["evidence"], one["right"]]
        for one in details
        if one["evidence"] is not None
    ]
    return _text(("kind", "evidence", "right"), rows)


def _text(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return out.getvalue()
