"""The answer of a diagnosis as records; `report.document` writes and reads them as JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Mapping

Kind = Literal["effect", "parameter", "none", "unknown"]


@dataclass(frozen=True, kw_only=True)
class Logs:
    """Names of the logs whose runs were fitted, and of those whose runs were held out."""

    estimation: tuple[str, ...]
    held_out: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """An estimated value and its standard error [unit]."""

    name: str
    value: float
    standard_error: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class ParameterDeviation:
    """A parameter that lies more than 3 standard errors from its nominal value.

    nominal, estimated, standard_error : [unit]
    """

    name: str
    nominal: float
    estimated: float
    standard_error: float
    unit: str

    @property
    def quantity(self) -> Quantity:
        """The estimated value."""
        return Quantity(
            name=self.name,
            value=self.estimated,
            standard_error=self.standard_error,
            unit=self.unit,
        )


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The cause of the gap.

    effects : the accepted effects
    classes : for each of them, the effects that these logs cannot tell from it, itself first
    parameters : the parameters that deviate from their nominal values
    confidence : probability that the verdict is right, by trials of known truth; None: not known
    statement : the verdict in one sentence
    next_experiment : the run that would decide what is open; None: nothing is open
    log_odds : what the confidence rests on, see `calibration.confidence`; None: of an axis, or of
        an older file
    """

    kind: Kind
    effects: tuple[str, ...]
    classes: tuple[tuple[str, ...], ...]
    parameters: tuple[ParameterDeviation, ...]
    confidence: float | None
    statement: str
    next_experiment: str | None
    log_odds: float | None = None


@dataclass(frozen=True, kw_only=True)
class Cell:
    """The gap of a channel within one bin of an axis, and the noise of its sensor [SI].

    axis : phase, speed, load, direction, frequency or time
    gap : rms of measured minus simulated, without effects
    samples : how many samples the rms is taken over; 0: not known
    """

    channel: str
    axis: str
    bin: str
    gap: float
    noise: float
    samples: int = 0


@dataclass(frozen=True, kw_only=True)
class Location:
    """The location of the gap.

    subsystem : None: there is no gap
    channel, phase : where the residual is largest over its noise; None: not known
    shares : each subsystem's share of the gap, the largest first, sum 1
    cells : the residual map along all axes; empty: the machine has no blocks to tell apart
    gain : of log probability, by unknown laws in the blocks that hold the gap; None: not asked
    """

    subsystem: str | None
    channel: str | None
    phase: str | None
    shares: Mapping[str, float]
    cells: tuple[Cell, ...]
    gain: float | None = None

    @property
    def maps(self) -> dict[str, tuple[Cell, ...]]:
        """Cells of the residual map by axis."""
        axes = dict.fromkeys(cell.axis for cell in self.cells)
        return {axis: tuple(c for c in self.cells if c.axis == axis) for axis in axes}


@dataclass(frozen=True, kw_only=True)
class HeldOutGap:
    """The gap on held-out runs: NRMSD by channel [1], that is rms over measured range.

    nominal : with the parameter set as given
    recalibrated : with the same equations and re-estimated parameters
    explained : with the accepted effects and re-estimated parameters
    noise_floor : of the noise alone
    closed_fraction : share of the gap above the noise that the verdict closes; None: not defined
    closed_fraction_ci95 : its 95 % interval
    """

    nominal: Mapping[str, float]
    recalibrated: Mapping[str, float]
    explained: Mapping[str, float]
    noise_floor: Mapping[str, float]
    closed_fraction: float | None
    closed_fraction_ci95: tuple[float, float] | None


@dataclass(frozen=True, kw_only=True)
class RankedEffect:
    """An effect that was tested.

    evidence : weighed fall of the cost that it brings
    held_out_gain : closed fraction with this effect alone; None: not predicted
    parameters : its sizes and shapes
    accepted : whether the verdict names it
    """

    effect: str
    subsystem: str
    evidence: float
    held_out_gain: float | None
    parameters: tuple[Quantity, ...]
    accepted: bool


@dataclass(frozen=True, kw_only=True)
class Undetectable:
    """An effect that these logs could not show at its plausible size, and why."""

    effect: str
    reason: str


@dataclass(frozen=True, kw_only=True)
class SearchStep:
    """A step of the search for effects.

    action : what was done with the set of effects, as led (along the measured speeds), confirmed,
        converged, reduced (from a refuted set), fitted anew, refuted by the runs or by other forms
        of a law, gains by few samples, or noise estimated there
    promised : gain that the linear regressions promised for the last effect, by regression
    gain : of log evidence over the fit without effects; of a led fit over the set without its last
        effect, led as well
    mean_square : of the whitened residual that the fit leaves
    """

    action: str
    effects: tuple[str, ...]
    promised: Mapping[str, float]
    gain: float
    mean_square: float


@dataclass(frozen=True, kw_only=True)
class SensorNoise:
    """The noise of a channel as its logs show it [SI].

    deviation : standard deviation, without outliers
    correlation_time : that an independent sample is worth [s]
    lines : frequencies of hum [Hz]
    outliers : share of the samples [1]
    held_period : time between new values of a channel that is sampled and held [s]; 0: not held
    white : whether the model leaves white innovations
    """

    channel: str
    deviation: float
    correlation_time: float
    lines: tuple[float, ...]
    outliers: float
    held_period: float
    white: bool


@dataclass(frozen=True, kw_only=True)
class Curve:
    """A missing law over one state, without a formula, within the range that the runs show.

    quantity, unit : of the law; over, over_unit : the state
    knots : values of the state; values, band : of the curve there, and half of its 95 % interval
    law : the drafted law there; None: it depends on more than the state
    """

    quantity: str
    unit: str
    over: str
    over_unit: str
    knots: tuple[float, ...]
    values: tuple[float, ...]
    band: tuple[float, ...]
    law: tuple[float, ...] | None = None


@dataclass(frozen=True, kw_only=True)
class Draft:
    """A law that no effect of the library is, drawn from the logs.

    place : subsystem; quantity, over : of the law, and the states that it depends on, in words
    form : the law as text, with unit; file : the effect file with it
    held_out_gain : share of the held-out gap that the draft closes [1]; None: there is none
    bound_ci95 : of the largest share that any curve or law that was tried closes held out [1], see
        `missing_law/bound.py`; bound : its upper end; None: the relations of the runs show no gap
    rivals : alternatives, other laws that come near
    """

    place: str
    quantity: str
    over: str
    form: str
    file: str
    held_out_gain: float | None
    held_out_gain_ci95: tuple[float, float] | None
    bound: float | None
    bound_ci95: tuple[float, float] | None
    rivals: tuple[str, ...]
    curve: Curve


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The whole answer: the verdict, and what it rests on.

    ranking : the best effect first; trace : the search in its order; noise : by channel
    drafts : of the missing law, the best one first; None: nobody asked for one
    """

    logs: Logs
    verdict: Verdict
    location: Location
    gap: HeldOutGap
    ranking: tuple[RankedEffect, ...]
    undetectable: tuple[Undetectable, ...]
    trace: tuple[SearchStep, ...] = ()
    noise: tuple[SensorNoise, ...] = ()
    drafts: tuple[Draft, ...] | None = None
