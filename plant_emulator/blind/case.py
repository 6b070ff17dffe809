"""What one case of the trial hides, as plain data."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from collections.abc import Mapping

Kind = Literal["none", "drift", "effect", "two", "outside"]


@dataclass(frozen=True, kw_only=True)
class Hidden:
    """A hidden effect.

    effect : name in the library; of an effect outside the library the law's own
    law : what it was simulated with: of `blind.laws`, or the library's where there is no other
    values : of the law, by parameter [SI]; states : of every run, by parameter
    """

    effect: str
    law: str
    subsystem: str
    outside: bool
    values: Mapping[str, float]
    states: tuple[Mapping[str, float], ...]

    def in_run(self, run: int) -> dict[str, float]:
        """All values of the law in one run [SI]."""
        return {**self.values, **self.states[run]}


@dataclass(frozen=True, kw_only=True)
class Case:
    """One bench with its runs.

    parameters : true values of what drifts, by name [SI]
    gaps : position in the gap at the start of every run, -1 to 1
    noise : seed of the sensors' noise
    """

    number: int
    kind: Kind
    programs: tuple[str, ...]
    hidden: tuple[Hidden, ...]
    parameters: Mapping[str, float]
    gaps: tuple[float, ...]
    noise: int

    @property
    def truth(self) -> str:
        """The case's row in the confusion matrix."""
        if self.kind in {"none", "drift"}:
            return self.kind
        names = "+".join(sorted(hidden.effect for hidden in self.hidden))
        return f"outside: {names}" if self.kind == "outside" else names

    def as_json(self) -> dict[str, Any]:
        """The case as JSON takes it."""
        return asdict(self)


def case_of(data: Mapping[str, Any]) -> Case:
    """The case that `as_json` has written."""
    hidden = tuple(Hidden(**{**h, "states": tuple(h["states"])}) for h in data["hidden"])
    tuples = {"programs": tuple(data["programs"]), "gaps": tuple(data["gaps"])}
    return Case(**{**data, **tuples, "hidden": hidden})
