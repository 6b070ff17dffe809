"""What a report draws beside the answer itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.diagnosis.prediction.remainder import Remainder
    from plant_emulator.diagnosis.prediction.trace import Trace


@dataclass(frozen=True, kw_only=True)
class Step:
    """A step of the waterfall: the held-out gap, in the noise, with its 95 % interval.

    gap : rms of the whitened held-out residual over all channels; 1: the noise floor
    """

    label: str
    gap: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class Details:
    """Everything but the answer.

    settings : how to repeat it: command, version, date, hashes of logs and sets, thresholds
    notes : what the preflight told of the logs
    rest : of a machine in outline, of which more than the noise is left
    """

    traces: tuple[Trace, ...]
    waterfall: tuple[Step, ...]
    settings: Mapping[str, str]
    notes: tuple[str, ...]
    rest: Remainder | None = None
