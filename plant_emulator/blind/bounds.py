"""Confidence bounds of a counted share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

# Probability that a bound does not hold.
TAIL_PROBABILITY = 0.05


def clopper_pearson(hits: int, of: int, tail: float = TAIL_PROBABILITY) -> tuple[float, float]:
    """Lower and upper bound of a probability after `hits` of `of` trials [1].

    Each bound fails with probability `tail` at most. The bounds are quantiles of beta
    distributions: C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404.
    """
    from scipy.stats import beta

    lower = float(beta.ppf(tail, hits, of - hits + 1)) if hits > 0 else 0.0
    upper = float(beta.ppf(1.0 - tail, hits + 1, of - hits)) if hits < of else 1.0
    return lower, upper


@dataclass(frozen=True)
class HitRate:
    """A count of hits among `of` cases."""

    hits: int
    of: int

    def to_json(self) -> dict[str, Any]:
        """The share with its one-sided 95 % bounds."""
        lower, upper = clopper_pearson(self.hits, self.of)
        share = self.hits / self.of if self.of else None
        return {
            "hits": self.hits, "of": self.of, "share": share, "lower95": lower, "upper95": upper
        }  # fmt: skip

    def __str__(self) -> str:
        if self.of == 0:
            return "none"
        lower, upper = clopper_pearson(self.hits, self.of)
        share = 100.0 * self.hits / self.of
        text = f"{self.hits} of {self.of}"
        return f"{text:10} {share:5.1f} %   above {100 * lower:5.1f} %, below {100 * upper:5.1f} %"


def share_of(flags: Sequence[bool]) -> HitRate:
    """Share of the flags that are true."""
    return HitRate(sum(flags), len(flags))
