"""The confidence in a verdict: how often one like it was right, among cases of known truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


@dataclass(frozen=True, kw_only=True)
class TrialVerdict:
    """A verdict of a blind trial: its kind, its evidence, and whether it was right."""

    kind: str
    evidence: float
    right: bool


# A share is taken of at least so many cases, if there are so many of a kind.
FEWEST_CASES = 20


def confidence(cases: Sequence[TrialVerdict], kind: str, evidence: float) -> float | None:
    """Share of right verdicts of this kind with at least this evidence [1].

    (right + 1) / (cases + 2)                                    (Laplace's rule of succession)

    Few cases thus give no certainty. If fewer than FEWEST_CASES effects had so much evidence, the
    FEWEST_CASES with the most count. The evidence of a verdict that names no effect says nothing:
    all cases of its kind count.
    None: there are no cases of this kind
    """
    same = sorted((c for c in cases if c.kind == kind), key=lambda c: -c.evidence)
    if not same:
        return None
    if kind == "effect":
        same = [c for k, c in enumerate(same) if k < FEWEST_CASES or c.evidence >= evidence]
    return (sum(c.right for c in same) + 1.0) / (len(same) + 2.0)
