"""The findings of a review, and whether a bench may be started with them."""

from dataclasses import asdict, dataclass
from typing import Any

SEVERITIES = ("error", "warning", "info")
"""The worst first."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One finding of a review.

    severity : one of SEVERITIES
    where : section and key, or register
    what, value, allowed : what is wrong or worth knowing, the value found, the values allowed
    """

    severity: str
    where: str
    what: str
    value: float | str
    allowed: str


@dataclass(frozen=True, kw_only=True)
class Review:
    """All findings on a configuration and its register map, the worst first."""

    findings: tuple[Finding, ...]

    @property
    def errors(self) -> tuple[Finding, ...]:
        """Findings that forbid a run."""
        return tuple(one for one in self.findings if one.severity == "error")

    @property
    def holds(self) -> bool:
        """Whether no finding is an error."""
        return not self.errors

    def to_json(self) -> dict[str, Any]:
        """Return the review as the document check/1."""
        findings = [asdict(one) for one in self.findings]
        return {"schema": "check/1", "holds": self.holds, "findings": findings}
