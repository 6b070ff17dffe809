"""The truth of one case of the trial, as plain data."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal

from plant_emulator.blind.dirt import Dirt

if TYPE_CHECKING:
    from collections.abc import Mapping

Kind = Literal["none", "deviation", "effect", "two", "outside"]


@dataclass(frozen=True, kw_only=True)
class Hidden:
    """A hidden effect.

    effect : name in the library; outside the library the name of the law
    law : name of the law that simulates the effect, in `blind.laws` or in the library
    values : parameters of the law [SI]
    states : parameters of the law that belong to one run, one mapping per run [SI]
    """

    effect: str
    law: str
    subsystem: str
    outside: bool
    values: Mapping[str, float]
    states: tuple[Mapping[str, float], ...]

    def in_run(self, run: int) -> dict[str, float]:
        """All parameters of the law in one run [SI]."""
        return {**self.values, **self.states[run]}


@dataclass(frozen=True, kw_only=True)
class Case:
    """The truth of one bench and its runs.

    kind : "none": the nominal bench; "deviation": parameters deviate; "effect": one effect of the
        library; "two": two of them; "outside": one effect outside the library
    parameters : true values of the parameters that deviate [SI]
    gaps : backlash gap position at the start of every run, -1 to 1
    noise : seed of the sensor noise
    dirt : of the logs; None: they are clean
    """

    number: int
    kind: Kind
    programs: tuple[str, ...]
    hidden: tuple[Hidden, ...]
    parameters: Mapping[str, float]
    gaps: tuple[float, ...]
    noise: int
    dirt: Dirt | None = None

    @property
    def truth(self) -> str:
        """The case's row in the confusion matrix."""
        if self.kind in {"none", "deviation"}:
            return self.kind
        names = "+".join(sorted(hidden.effect for hidden in self.hidden))
        return f"outside: {names}" if self.kind == "outside" else names

    def to_json(self) -> dict[str, Any]:
        """The case as JSON types."""
        return asdict(self)


def case_of(data: Mapping[str, Any]) -> Case:
    """The case from the data of `Case.to_json`."""
    hidden = tuple(Hidden(**{**h, "states": tuple(h["states"])}) for h in data["hidden"])
    tuples = {"programs": tuple(data["programs"]), "gaps": tuple(data["gaps"])}
    dirt = Dirt(**data["dirt"]) if data.get("dirt") else None
    return Case(**{**data, **tuples, "hidden": hidden, "dirt": dirt})
