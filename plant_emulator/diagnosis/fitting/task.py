"""One task of a diagnosis as plain data, for a pool to run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.signature import Signature


@dataclass(frozen=True, kw_only=True)
class Task:
    """What a step of the diagnosis is asked to do.

    base : fit that the step begins with
    runs : that the step fits
    effect : that comes in on top of the base; empty: none
    signature : of the effect, which gives a start; None: it has not been computed
    number : of the start, where there are several
    known : runs that the base was fitted to, where these are not all
    """

    base: FitResult
    runs: tuple[int, ...]
    effect: str = ""
    signature: Signature | None = None
    number: int = 0
    known: tuple[int, ...] = ()
