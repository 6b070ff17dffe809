"""The answer of a trial (schema blind-trial/1) and its table for the terminal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.blind.bounds import HitRate, share_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from plant_emulator.blind.result import CaseResult

    Results = Sequence[CaseResult]

WITHOUT_EFFECT = {"none", "deviation"}
OF_THE_LIBRARY = {"effect", "two"}


@dataclass(frozen=True, kw_only=True)
class TrialAnswer:
    """The results of a trial.

    manifest_sha256 : of the file with all commitments
    program_sha256 : of the program's source and data
    """

    results: tuple[CaseResult, ...]
    seed: int
    manifest_sha256: str
    program_sha256: str

    def to_json(self) -> dict[str, Any]:
        """The machine-readable answer, schema blind-trial/1."""
        counted = shares(self.results)
        return {
            "schema": "blind-trial/1",
            "cases": len(self.results),
            "correct": counted["right"].hits,
            "false_alarms": counted["false alarms"].hits,
            "unknown_recognised": counted["unknown recognised"].hits,
            "location_correct": counted["right place"].hits,
            "confusion": confusion(self.results),
            "details": [one.to_json() for one in self.results],
            "seed": self.seed,
            "manifest_sha256": self.manifest_sha256,
            "program_sha256": self.program_sha256,
            "shares": {name: share.to_json() for name, share in counted.items()},
            "shrinkage_error": closed_fraction_error(self.results),
        }

    def __str__(self) -> str:
        """The table of the terminal: shares with their bounds, then every wrong case."""
        count = len(self.results)
        text = [f"Blind trial, seed {self.seed}, {count} cases; one-sided 95 % bounds:"]
        text += [f"  {name:31} {share}" for name, share in shares(self.results).items()]
        error = closed_fraction_error(self.results)
        if error is not None:
            text.append(
                f"  {'error of predicted shrinkage':31} median {100 * error['median']:.1f} %, "
                f"largest {100 * error['largest']:.1f} %"
            )
        wrong = [one for one in self.results if not one.right]
        text.append("Not right:" if wrong else "Every case is right.")
        return "\n".join([*text, *(f"  {line(one)}" for one in wrong)])


def shares(results: Results) -> dict[str, HitRate]:
    """Shares of the cases by the names of their table lines."""

    def count(flag: str, chosen: Callable[[CaseResult], bool]) -> HitRate:
        return share_of([bool(getattr(one, flag)) for one in results if chosen(one)])

    def is_inside(one: CaseResult) -> bool:
        return one.kind in OF_THE_LIBRARY and one.detectable

    def is_outside(one: CaseResult) -> bool:
        return one.kind == "outside" and one.detectable

    outside = [one for one in results if is_outside(one)]
    sizes = [size for one in results for size in one.sizes]
    return {
        "right": share_of([one.right for one in results]),
        "detectable effects, class": count("right", is_inside),
        "detectable effects, first name": count("top1", is_inside),
        "false alarms": count("false_alarm", lambda one: one.kind in WITHOUT_EFFECT),
        "unknown recognised": share_of([one.verdict == "unknown" for one in outside]),
        "false names outside": share_of([one.verdict == "effect" for one in outside]),
        "undetectable, nothing named": count(
            "right", lambda one: one.kind not in WITHOUT_EFFECT and not one.detectable
        ),
        "right place": count("located", lambda one: is_inside(one) or is_outside(one)),
        "sizes covered, same law": share_of([s.covered for s in sizes if s.same_law]),
        "sizes covered, other law": share_of([s.covered for s in sizes if not s.same_law]),
        "shrinkage covered": share_of(_list_covered(results)),
    }


def _list_covered(results: Results) -> list[bool]:
    """Whether the interval of the closed fraction holds its true value, of every case with both."""
    return [
        one.closed_fraction_ci95[0] <= one.closed_fraction_true <= one.closed_fraction_ci95[1]
        for one in results
        if one.closed_fraction_ci95 is not None and one.closed_fraction_true is not None
    ]


def closed_fraction_error(results: Results) -> dict[str, float] | None:
    """Median and largest magnitude of the closed fraction's error in the right cases [1]."""
    errors = [
        one.closed_fraction - one.closed_fraction_true
        for one in results
        if one.right and one.closed_fraction is not None and one.closed_fraction_true is not None
    ]
    if not errors:
        return None
    size = np.abs(errors)
    return {"median": float(np.median(size)), "largest": float(np.max(size))}


def confusion(results: Results) -> dict[str, dict[str, int]]:
    """Confusion matrix: number of cases by truth and answer."""
    counts: dict[str, dict[str, int]] = {}
    for one in results:
        row = counts.setdefault(one.truth, {})
        row[one.answered] = row.get(one.answered, 0) + 1
    return {truth: dict(sorted(row.items())) for truth, row in sorted(counts.items())}


def line(one: CaseResult) -> str:
    """One case in one line."""
    norms = ", ".join(f"{hidden.norm:.0f}" for hidden in one.hidden)
    size = f" (norm {norms})" if norms else ""
    place = "" if one.subsystem is None else f" in {one.subsystem}"
    return f"case {one.case:3}: {one.truth}{size} answered as {one.answered}{place}"
