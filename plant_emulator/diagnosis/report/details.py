"""Details of a report that are not part of the answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.diagnosis.noise.spectra import Spectrum
    from plant_emulator.diagnosis.prediction.remainder import Remainder
    from plant_emulator.diagnosis.prediction.trace import Trace
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class Step:
    """A step of the waterfall: the held-out gap of one model, in multiples of the noise.

    gap : rms of the whitened held-out residual over all channels; 1: the noise floor
    low, high : its 95 % interval
    """

    label: str
    gap: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class EstimatedInput:
    """An input of a run that nobody measured: estimate and standard deviation [unit], shape (n,).

    time : of the samples [s], shape (n,)
    """

    source: str
    name: str
    unit: str
    time: Array
    value: Array
    deviation: Array


@dataclass(frozen=True, kw_only=True)
class Details:
    """Details of a report that are not part of the answer.

    settings : what repeats the diagnosis: command, version, date, hashes of files, thresholds
    notes : what was noticed about the logs, a sentence each
    remainder : the unmodelled remainder; None for a machine that is modelled down to its noise
    inputs : of the runs that nobody measured
    spectra : of the channels of a machine that is modelled down to its noise
    draft_traces : held-out runs, predicted without and with the best draft of a missing law
    """

    traces: tuple[Trace, ...]
    waterfall: tuple[Step, ...]
    settings: Mapping[str, str]
    notes: tuple[str, ...]
    remainder: Remainder | None = None
    inputs: tuple[EstimatedInput, ...] = ()
    spectra: tuple[Spectrum, ...] = ()
    draft_traces: tuple[Trace, ...] = ()
