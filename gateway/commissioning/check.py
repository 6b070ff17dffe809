"""A check of the bench: a value beside its limit, and where the limit comes from (pure)."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import isfinite, nan
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Check:
    """One value beside its limit, in the operator's unit.

    name : of the check; what : of this value
    value : NaN where the run does not show it
    limit : largest size of the value that is allowed
    source : where the limit comes from
    """

    name: str
    what: str
    value: float
    unit: str
    limit: float
    source: str

    @property
    def holds(self) -> bool:
        """Whether the value lies within the limit; a value that is missing does not."""
        return abs(self.value) <= self.limit

    def to_json(self) -> dict[str, Any]:
        """Return the check as an entry of a document."""
        value = self.value if isfinite(self.value) else None
        return {**asdict(self), "value": value, "holds": self.holds}

    def __str__(self) -> str:
        shown = f"{self.value:+9.2f}" if isfinite(self.value) else "  missing"
        mark = "" if self.holds else "  OUTSIDE"
        return (
            f"{self.name:13s} {self.what:58s} {shown} {self.unit:4s} "
            f"of {self.limit:6.4g}  {self.source}{mark}"
        )


def missing(name: str, what: str, unit: str, limit: float, source: str) -> Check:
    """Check whose value the run does not show."""
    return Check(name=name, what=what, value=nan, unit=unit, limit=limit, source=source)


def page(checks: Sequence[Check]) -> str:
    """Lines for the operator: one a value, and what the whole says."""
    outside = list(dict.fromkeys(one.name for one in checks if not one.holds))
    last = f"outside: {', '.join(outside)}" if outside else "every value lies within its limit"
    return "\n".join((*map(str, checks), last))
