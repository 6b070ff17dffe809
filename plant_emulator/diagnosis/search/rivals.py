"""Chooses the effects that are fitted on top of a fit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.search.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.search.promise import Promise


def rivals(
    found: Sequence[Promise], base: FitResult, best: FitResult, least: float
) -> list[Promise]:
    """Effects that promise most by each score: the first one and its rivals.

    found : the largest first; best : fit with the first one on top of `base`; `base`: none
        is fitted yet
    least : gain that an effect must promise
    """
    most = SETTINGS.rivals_beside if base.effects else SETTINGS.rivals
    most += best is base
    return leading(found, best.effects, most, least)


def leading(
    found: Sequence[Promise], known: Sequence[str], most: int, least: float
) -> list[Promise]:
    """So many effects of each score, beside those known, that gain half of its most or more.

    least : gain that an effect must promise
    """
    near: dict[str, Promise] = {}
    for score in dict.fromkeys(score for p in found for score in p.gains):
        order = sorted(found, key=lambda p: -p.gains.get(score, 0.0))
        needed = max(least, SETTINGS.rival_share * order[0].gains.get(score, 0.0))
        rest = [p for p in order if p.effect not in known][:most]
        near |= {p.effect: p for p in rest if p.gains.get(score, 0.0) > needed}
    return list(near.values())
