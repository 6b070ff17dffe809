"""Chooses the rivals of the first effect that is fitted on top of a fit."""

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
    return _leading(found, found[0], most, share)


def fitted_rivals(found: Sequence[Promise], fitted: Sequence[Promise]) -> list[Promise]:
    """Effects that gain most in their fits by secants, and the effect that leads by each score.

    found : predicted, the largest first; fitted : by secants, the largest first
    """
    gaining = [p for p in fitted if p.gain > SETTINGS.promising]
    rivals = _leading(gaining, found[0], SETTINGS.rivals, SETTINGS.rival_share)
    known = {p.effect for p in rivals}
    leaders = _leading(found, found[0], 1, SETTINGS.rival_share)
    return [*rivals, *(p for p in leaders if p.effect not in known)]


def _leading(found: Sequence[Promise], first: Promise, most: int, share: float) -> list[Promise]:
    """So many effects of each score beside the first, with this share of the score's largest."""
    near: dict[str, Promise] = {}
    for score in found[0].gains if found else ():
        order = sorted(found, key=lambda p: -p.gains.get(score, 0.0))
        least = share * order[0].gains.get(score, 0.0)
        rest = [p for p in order if p.effect != first.effect][:most]
        near |= {p.effect: p for p in rest if p.gains.get(score, 0.0) > least}
    return list(near.values())
