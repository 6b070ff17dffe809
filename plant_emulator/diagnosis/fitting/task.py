"""One fit of a diagnosis as plain data, for a pool to run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.signature import Signature


@dataclass(frozen=True, kw_only=True)
class Task:
    """One step: an effect, or none, on top of a fit, on these runs.

    signature : where a joint fit starts from, if it has been computed
    number : of several starts
    known : runs that `base` is a fit of, where it is not one of all
    """

    base: FitResult
    runs: tuple[int, ...]
    effect: str = ""
    signature: Signature | None = None
    number: int = 0
    known: tuple[int, ...] = ()
