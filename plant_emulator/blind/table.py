"""The cases of a trial as CSV tables: one for a spreadsheet, one to calibrate the confidence."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.blind.result import CaseResult

COLUMNS = (
    "case", "kind", "truth", "norm", "detectable", "programs", "verdict", "answered", "class",
    "evidence", "confidence", "right", "first_name", "false_alarm", "true_place", "place",
    "located", "closed_fraction", "closed_fraction_true", "seconds", "error",
    "dirt",
)  # fmt: skip


def row(one: CaseResult) -> list[Any]:
    """One case in the order of COLUMNS."""
    return [
        one.case,
        one.kind,
        one.truth,
        " ".join(f"{h.norm:.1f}" for h in one.hidden),
        one.detectable,
        " ".join(one.programs),
        one.verdict,
        one.answered,
        " | ".join(" ".join(names) for names in one.classes),
        one.evidence,
        one.confidence,
        one.right,
        one.top1,
        one.false_alarm,
        " ".join(h.subsystem for h in one.hidden),
        one.subsystem,
        one.located,
        one.closed_fraction,
        one.closed_fraction_true,
        one.seconds,
        one.error,
        one.dirt,
    ]


def cases(results: Sequence[CaseResult]) -> str:
    """CSV text with all cases."""
    return _text(COLUMNS, [row(one) for one in results])


def evidence_table(results: Sequence[CaseResult]) -> str:
    """CSV text with verdict, log odds and correctness of every case that has an answer."""
    rows = [[one.verdict, one.log_odds, one.right] for one in results if one.log_odds is not None]
    return _text(("kind", "log_odds", "right"), rows)


def _text(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return out.getvalue()
