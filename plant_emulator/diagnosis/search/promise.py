"""What one more effect promises on top of a fit, and where a fit with it may begin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True, kw_only=True)
class Start:
    """A start of a joint fit: values by name, and the states of each run."""

    values: Mapping[str, float]
    states: tuple[Mapping[str, float], ...]


@dataclass(frozen=True, kw_only=True)
class Promise:
    """Gain of log evidence of one more effect, by each score: predicted, or reached by a fit."""

    effect: str
    gains: Mapping[str, float]
    starts: tuple[Start, ...]

    @property
    def gain(self) -> float:
        """The largest score."""
        return max(self.gains.values(), default=0.0)
