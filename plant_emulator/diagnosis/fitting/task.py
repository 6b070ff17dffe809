"""One task of a diagnosis as plain data, for a pool to run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fit_result import FitResult


@dataclass(frozen=True, kw_only=True)
class Task:
    """The input of a task of the diagnosis.

    base : fit that the step begins with
    runs : that the step fits
    effect : that comes in on top of the base; empty: none
    """

    base: FitResult
    runs: tuple[int, ...]
    effect: str = ""
