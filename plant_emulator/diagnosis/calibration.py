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


def confidence(cases: Sequence[Case], kind: str, evidence: float) -> float:
    """Share of right answers among the cases of this kind with at least this evidence.

    Laplace's rule of succession, (right + 1) / (cases + 2): few cases give no certainty. More
    evidence than any case had counts as much as the most that one had. The evidence of a verdict
    that names nothing says nothing: all cases of its kind count.
    """
    same = [case for case in cases if case.kind == kind]
    most = max((case.evidence for case in same), default=0.0)
    if kind == "effect":
        same = [case for case in same if case.evidence >= min(evidence, most)]
    return (sum(case.right for case in same) + 1.0) / (len(same) + 2.0)
