"""From where the joint fit of an effect starts, and how far it is followed at first.

A cost of many valleys and a rough bottom has no start that is always right; each of these has found
effects that the others missed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.elsewhere import smoothed
from plant_emulator.diagnosis.fitting.evidence import excess
from plant_emulator.diagnosis.fitting.joint_fit import WORTHWHILE_FALL, fit
from plant_emulator.diagnosis.fitting.signature import FAR, signs, values_at_size
from plant_emulator.diagnosis.fitting.valleys import best_sizes, best_states

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.signature import Signature
    from plant_emulator.diagnosis.machine import Model
    from plant_emulator.estimation.unknowns import Estimate

# Steps of a first look, whose drift follows by secants: most of what ten find, the first four find.
GLANCE = 5
# Steps of a fit that only has to show whether it is worth more: without and with states of its
# own, which make a long curved valley of the cost.
FEW, FEW_WITH_STATES = 8, 24
# Costs above that of the fit without an effect, from which on a fit with it has stopped on its way
# [gap], and finds no way [that cost].
ON_THE_WAY, HOPELESS = 0.02, 20.0
# Steps of a fit through where drift follows an effect along a curve.
PATIENT = 25


def glance(
    model: Model, found: Signature, base: FitResult, runs: Sequence[int], near: Estimate
) -> FitResult:
    """A first look at the joint fit of one more effect, from its signature's start, or, where that
    stops on its way back, from the drift as it is.

    near : the base's estimate; the drift's slopes follow from its own, only the effect's are
        simulated
    """
    effects = (*base.effects, found.effect)
    best = fit(model, effects, runs, found.start, found.states, GLANCE, near)
    if best.cost < _on_the_way(base):
        return best
    states = [{**own, **state} for own, state in zip(found.states, base.states, strict=True)]
    small = {**found.start, **base.values}
    other = fit(model, effects, runs, small, states, GLANCE, near)
    return min(best, other, key=lambda p: p.cost)


def glance_far(
    model: Model, found: Signature, base: FitResult, runs: Sequence[int], near: Estimate
) -> FitResult | None:
    """A first look at the joint fit of one more effect, from a larger size; None: it has none.

    On with wide slopes where it stops on the way, for the way back from where the drift has gone to
    imitate an effect is rough; not where nothing is in the way, nor from where none leads back.
    """
    if found.far is None:
        return None
    effects = (*base.effects, found.effect)
    start = fit(model, effects, runs, *found.far, GLANCE, near)
    stopped = _on_the_way(base) < start.cost < HOPELESS * base.cost
    return smoothed(model, effects, runs, start) if stopped else start


def _on_the_way(base: FitResult) -> float:
    """Cost from which on a fit with one more effect has stopped on its way to where it is none."""
    return base.cost + WORTHWHILE_FALL + ON_THE_WAY * excess(base)


def patient(model: Model, found: Signature, base: FitResult, runs: Sequence[int]) -> FitResult:
    """The joint fit of one more effect from a size on either side, the drift as it is, and with
    steps enough to come through where drift follows the effect along a curve.
    """
    candidate = model.candidates[found.effect]
    own = {u.name for u in candidate.states}
    states = [
        {**state, **{name: value for name, value in more.items() if name in own}}
        for state, more in zip(base.states, found.states, strict=True)
    ]
    effects = (*base.effects, found.effect)
    tries = [
        fit(
            model,
            effects,
            runs,
            {**base.values, **values_at_size(candidate, sign * FAR)},
            states,
            PATIENT,
        )
        for sign in signs(candidate.sizes)
    ]
    return min(tries, key=lambda p: p.cost)


def look(model: Model, effects: Sequence[str], runs: Sequence[int], start: FitResult) -> FitResult:
    """A few steps of a joint fit, from where another fit has come to; what the last effect has of
    many valleys is looked for anew.
    """
    states, few = start.states, FEW
    if any(model.candidates[name].states for name in effects):
        states = best_states(model, effects, runs, start.values, states, anew=effects[-1:])
        few = FEW_WITH_STATES
    values = best_sizes(model, effects, runs, start.values, states)
    return fit(model, effects, runs, values, states, few)
