"""The answer of a trial, schema blind-trial/1, and its table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.blind.bounds import Share, share_of
from plant_emulator.blind.score import confusion

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    Details = Sequence[Mapping[str, Any]]

WITHOUT = {"none", "drift"}
INSIDE = {"effect", "two"}


def shares(details: Details) -> dict[str, Share]:
    """What is counted, each by its line in the table."""

    def count(chosen: Callable[[Mapping[str, Any]], bool], key: str) -> Share:
        return share_of([bool(one[key]) for one in details if chosen(one)])

    def inside(one: Mapping[str, Any]) -> bool:
        return bool(one["kind"] in INSIDE and one["detectable"])

    def outside(one: Mapping[str, Any]) -> bool:
        return bool(one["kind"] == "outside" and one["detectable"])

    unknown = [one["verdict"] == "unknown" for one in details if outside(one)]
    named = [one["verdict"] == "effect" for one in details if outside(one)]
    sizes = [size for one in details for size in one["sizes"]]
    return {
        "right": share_of([bool(one["right"]) for one in details]),
        "detectable effects, class": count(inside, "right"),
        "detectable effects, first name": count(inside, "top1"),
        "false alarms": count(lambda one: one["kind"] in WITHOUT, "false_alarm"),
        "unknown recognised": share_of(unknown),
        "false names outside": share_of(named),
        "undetectable, nothing named": count(
            lambda one: one["kind"] not in WITHOUT and not one["detectable"], "right"
        ),
        "right place": count(lambda one: inside(one) or outside(one), "located"),
        "sizes covered, same law": share_of([s["covered"] for s in sizes if s["same_law"]]),
        "sizes covered, other law": share_of([s["covered"] for s in sizes if not s["same_law"]]),
        "shrinkage covered": share_of(_covered(details)),
    }


def _told(details: Details) -> list[Mapping[str, Any]]:
    """Cases with a predicted and a true shrinkage."""
    return [
        one
        for one in details
        if one["closed_fraction"] is not None and one["closed_fraction_true"] is not None
    ]


def _covered(details: Details) -> list[bool]:
    told = [one for one in _told(details) if one["closed_fraction_ci95"] is not None]
    return [
        one["closed_fraction_ci95"][0]
        <= one["closed_fraction_true"]
        <= one["closed_fraction_ci95"][1]
        for one in told
    ]


def shrinkage_error(details: Details) -> dict[str, float] | None:
    """Predicted less true closed fraction over the rightly answered cases."""
    errors = [
        one["closed_fraction"] - one["closed_fraction_true"]
        for one in _told(details)
        if one["right"]
    ]
    if not errors:
        return None
    size = np.abs(errors)
    return {"median": float(np.median(size)), "largest": float(np.max(size))}


def answer(details: Details, seed: int, manifest: str, program: str) -> dict[str, Any]:
    """The machine-readable answer.

    manifest, program : SHA-256 of the file with all commitments, and of the code
    """
    counted = shares(details)
    return {
        "schema": "blind-trial/1",
        "cases": len(details),
        "correct": counted["right"].hits,
        "false_alarms": counted["false alarms"].hits,
        "unknown_recognised": counted["unknown recognised"].hits,
        "location_correct": counted["right place"].hits,
        "confusion": confusion(details),
        "details": list(details),
        "seed": seed,
        "manifest_sha256": manifest,
        "program_sha256": program,
        "shares": {name: share.as_json() for name, share in counted.items()},
        "shrinkage_error": shrinkage_error(details),
    }


def lines(details: Details, seed: int) -> list[str]:
    """The table of the terminal: counts with their bounds, then every case that is wrong."""
    text = [f"Blind trial, seed {seed}, {len(details)} cases; one-sided 95 % bounds:"]
    text += [f"  {name:31} {share}" for name, share in shares(details).items()]
    error = shrinkage_error(details)
    if error is not None:
        text.append(
            f"  {'error of predicted shrinkage':31} median {100 * error['median']:.1f} %, "
            f"largest {100 * error['largest']:.1f} %"
        )
    wrong = [one for one in details if not one["right"]]
    text.append("Not right:" if wrong else "Every case is right.")
    text += [f"  {line(one)}" for one in wrong]
    return text


def line(one: Mapping[str, Any]) -> str:
    """One case in one line."""
    norms = ", ".join(f"{hidden['norm']:.0f}" for hidden in one["hidden"])
    size = f" (norm {norms})" if norms else ""
    place = "" if one["subsystem"] is None else f" in {one['subsystem']}"
    return f"case {one['case']:3}: {one['truth']}{size} answered as {one['answered']}{place}"
