"""The result of one case of the trial, as a record and as JSON data."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.blind.case import Kind


@dataclass(frozen=True, kw_only=True)
class HiddenEffect:
    """A hidden effect: the law that simulated it, its parameters [SI], its orthogonal norm."""

    effect: str
    law: str
    subsystem: str
    values: Mapping[str, float]
    norm: float


@dataclass(frozen=True, kw_only=True)
class ScoredSize:
    """True and estimated value of an effect's parameter [SI].

    covered : whether the 95 % interval of the estimate holds the true value
    same_law : whether the library's own law simulated the effect
    """

    effect: str
    parameter: str
    true: float
    estimated: float
    standard_error: float
    covered: bool
    same_law: bool


@dataclass(frozen=True, kw_only=True)
class CaseResult:
    """Truth, answer and score of one case.

    case : number, from 1; truth, answered : row and column of the confusion matrix
    classes : effects that the logs cannot tell apart, one class per named effect
    top1 : whether the named effects are exactly the hidden ones
    closed_fraction : of the answer; closed_fraction_true : against the noise-free logs
    seconds : duration of the case; error : last line of a failed diagnosis
    dirt : kind of dirt of its logs; empty: they are clean
    log_odds : how the answer stands, see `diagnosis.calibration.confidence`
    """

    case: int
    kind: Kind
    truth: str
    hidden: tuple[HiddenEffect, ...]
    programs: tuple[str, ...]
    detectable: bool
    verdict: str
    effects: tuple[str, ...]
    classes: tuple[tuple[str, ...], ...]
    answered: str
    evidence: float | None
    confidence: float | None
    right: bool
    top1: bool
    false_alarm: bool
    subsystem: str | None
    located: bool
    closed_fraction: float | None
    closed_fraction_ci95: tuple[float, float] | None
    closed_fraction_true: float | None
    sizes: tuple[ScoredSize, ...]
    seconds: float = 0.0
    error: str = ""
    dirt: str = ""
    log_odds: float | None = None

    def to_json(self) -> dict[str, Any]:
        """The result as JSON types; `classes` has the key "class"."""
        return {"class" if key == "classes" else key: one for key, one in asdict(self).items()}


def result_from(data: Mapping[str, Any]) -> CaseResult:
    """The result from the data of `CaseResult.to_json`, as they come back from a JSON file."""
    interval = data["closed_fraction_ci95"]
    read = {
        "hidden": tuple(HiddenEffect(**one) for one in data["hidden"]),
        "programs": tuple(data["programs"]),
        "effects": tuple(data["effects"]),
        "classes": tuple(tuple(names) for names in data["class"]),
        "closed_fraction_ci95": None if interval is None else (interval[0], interval[1]),
        "sizes": tuple(ScoredSize(**one) for one in data["sizes"]),
    }
    return CaseResult(**{key: one for key, one in data.items() if key != "class"} | read)
