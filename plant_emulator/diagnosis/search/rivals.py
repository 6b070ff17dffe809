"""Chooses the effects that are fitted on top of a fit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE
from plant_emulator.diagnosis.search.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.search.promise import Promise


def predicted_rivals(found: Sequence[Promise], base: FitResult, best: FitResult) -> list[Promise]:
    """Effects that promise most by each score, beside the first.

    found : the largest first; best : fit with the first on top of `base`
    """
    most = SETTINGS.rivals_beside if base.effects else SETTINGS.rivals
    leaves_noise = best.mean_square <= NOISE_MEAN_SQUARE
    share = SETTINGS.rival_share if leaves_noise else SETTINGS.hopeless_share
    return _leading(found, (found[0].effect,), most, share)


def fitted_rivals(
    found: Sequence[Promise], fitted: Sequence[Promise], base: FitResult, best: FitResult
) -> list[Promise]:
    """Effects that gain most in their fits by secants, and the effect that leads by each score.

    The first effect is one of them where its fit by secants is the better one.

    found : predicted, the largest first; fitted : by secants
    best : fit with the first effect on top of `base`
    """
    first, reached = found[0].effect, 0.5 * (base.cost - best.cost)
    gaining = [p for p in fitted if p.gain > (reached if p.effect == first else SETTINGS.promising)]
    rivals = _leading(gaining, (), SETTINGS.rivals, SETTINGS.rival_share)
    known = (first, *(p.effect for p in rivals))
    return [*rivals, *_leading(found, known, 1, SETTINGS.rival_share)]


def gaining(fitted: Sequence[Promise], needed: float) -> list[Promise]:
    """The next effect of a set that leaves more than the noise, and its rivals.

    What such a set leaves has bent its parameters, so that predictions mislead.

    fitted : by secants, the largest first; needed : least gain
    """
    least = max(needed, SETTINGS.hopeless_share * max((p.gain for p in fitted), default=0.0))
    return [p for p in fitted if p.gain > least][: 1 + SETTINGS.rivals_beside]


def _leading(
    found: Sequence[Promise], known: Sequence[str], most: int, share: float
) -> list[Promise]:
    """So many effects of each score beside those known, with this share of the score's largest."""
    near: dict[str, Promise] = {}
    for score in dict.fromkeys(score for p in found for score in p.gains):
        order = sorted(found, key=lambda p: -p.gains.get(score, 0.0))
        least = share * order[0].gains.get(score, 0.0)
        rest = [p for p in order if p.effect not in known][:most]
        near |= {p.effect: p for p in rest if p.gains.get(score, 0.0) > least}
    return list(near.values())
