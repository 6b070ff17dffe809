"""One thing that a review has found, and how bad things are."""

from dataclasses import dataclass

SEVERITIES = ("error", "warning", "info")
"""The worst first."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing found: how bad, where (section and key), what, its value and what is allowed."""

    severity: str
    where: str
    what: str
    value: float | str
    allowed: str


def holds(findings: list[Finding]) -> bool:
    """Whether nothing is an error."""
    return all(finding.severity != "error" for finding in findings)
