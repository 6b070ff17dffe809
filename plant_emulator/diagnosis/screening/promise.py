"""What one more effect promises on top of a fit, and where a fit with it may begin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult


@dataclass(frozen=True, kw_only=True)
class Start:
    """A start of a joint fit: values by name, and the states of each run."""

    values: Mapping[str, float]
    states: tuple[Mapping[str, float], ...]


@dataclass(frozen=True, kw_only=True)
class Promise:
    """Gain of log evidence of one more effect, by each score: predicted, or reached by a fit.

    starts : of a fit, by score; none of a regression where the effect shows nothing
    """

    effect: str
    gains: Mapping[str, float]
    starts: Mapping[str, Start]

    @property
    def gain(self) -> float:
        """The largest score."""
        return max(self.gains.values(), default=0.0)


def starts_of(promise: Promise, base: FitResult) -> tuple[tuple[Start, ...], tuple[Start, ...]]:
    """Starts of an effect near the data on top of a fit, and those that are led; the best first.

    All estimates of regressions are led. Near the data an estimate may miss contact, because it
    moves all unknowns at once: the best one is also a start with the parameters and states of the
    fit. An estimate that promises far less than another may tell a size at which a limit does not
    act, and a fit would stay there: it is no start near the data.
    """
    order = sorted(promise.starts, key=lambda score: -promise.gains[score])
    told = tuple(promise.starts[score] for score in order)
    least = SETTINGS.rival_share * promise.gain
    best, *others = told
    kept = Start(
        values={**best.values, **base.values},
        states=tuple({**own, **fit} for own, fit in zip(best.states, base.states, strict=True)),
    )
    near = [one for one, s in zip(others, order[1:], strict=True) if promise.gains[s] > least]
    return (best, *near, kept), told


def leading(
    found: Sequence[Promise], most: int, least: float, tried: Sequence[str]
) -> list[Promise]:
    """So many effects of each score that gain half of its most or more, score by score.

    least : gain that an effect must promise; tried : effects to leave out
    """
    near: dict[str, Promise] = {}
    for score in dict.fromkeys(score for p in found for score in p.gains):
        order = sorted(found, key=lambda p: -p.gains.get(score, 0.0))
        needed = max(least, SETTINGS.rival_share * order[0].gains.get(score, 0.0))
        rest = [p for p in order if p.effect not in tried][:most]
        near |= {p.effect: p for p in rest if p.gains.get(score, 0.0) > needed}
    return list(near.values())


def to_try(
    found: Sequence[Promise], base: FitResult, least: float, tried: Sequence[str]
) -> list[Promise]:
    """Effects to try on top of a fit: the leading ones that were not tried.

    Without effects, where no more than noise is left, an effect is faint, and a fit is cheap. All
    that promise enough are tried there.
    """
    if base.mean_square <= NOISE_MEAN_SQUARE and not base.effects:
        return [p for p in found if p.gain > least]
    return leading(found, SETTINGS.leaders, least, tried)
