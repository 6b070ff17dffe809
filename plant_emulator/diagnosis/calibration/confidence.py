"""How often an answer of so much evidence was right, among simulated cases of known truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


@dataclass(frozen=True, kw_only=True)
class Case:
    """A verdict of a blind trial: its kind, its evidence, whether it was right."""

    kind: str
    evidence: float
    right: bool


# Cases that a share is taken of at least, if there are so many of a kind.
FEWEST = 20


def confidence(cases: Sequence[Case], kind: str, evidence: float) -> float | None:
    """Share of right answers among the cases of this kind with at least this evidence; None: there
    are none of this kind.

    Laplace's rule of succession, (right + 1) / (cases + 2): few cases give no certainty. Of an
    effect with more evidence than FEWEST cases had, these count. The evidence of a verdict that
    names nothing says nothing: all cases of its kind count.
    """
    same = sorted((c for c in cases if c.kind == kind), key=lambda c: -c.evidence)
    if not same:
        return None
    if kind == "effect":
        same = [c for k, c in enumerate(same) if k < FEWEST or c.evidence >= evidence]
    return (sum(c.right for c in same) + 1.0) / (len(same) + 2.0)
