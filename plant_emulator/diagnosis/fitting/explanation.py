"""Hypotheses about the machine, and what the tests of all hypotheses found."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import CLASS_MARGIN, evidence_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.answer import SearchStep
    from plant_emulator.diagnosis.fit_result import FitResult, VarianceComponent
    from plant_emulator.diagnosis.fitting.regularity import Regularity
    from plant_emulator.estimation.noise.channel_noise import ChannelNoise


@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """The hypothesis that the machine has one effect of the library.

    total_norm : norm of the effect's signature at its plausible size
    orthogonal_norm : norm of the part of the signature that no nuisance parameter can follow
    confounded_with : nuisance parameter that follows the signature most
    fit : joint fit with the effect; None where the signature vanishes, or promises nothing beyond
        the noise
    """

    effect: str
    orthogonal_norm: float
    total_norm: float
    confounded_with: str
    fit: FitResult | None


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """The result of the hypothesis tests.

    null : fit without effects
    final : fit with the accepted effects
    hypotheses : of the first round, one for each effect of the library
    alternatives : for each accepted effect, the costs of the fits with another effect in its place
    unconverged : reason why the result cannot be trusted; empty where it can
    random_effects : accepted random effects, beside the effects of `final`
    reduced_costs : for each of several accepted effects, the least cost of a fit without it; empty
        where the final fit is no cause
    uncertain : effects of the final fit without a certain size beside the others; not named
    trace : the search in its order
    noise : of every channel as the logs show it; empty where it is as declared
    log_odds : of the final set against its best rival, in the mean square that it leaves [nats]
    regularities : of what the final fit leaves, beside the random effects
    margins : for each accepted effect, the evidence up to which nothing tells another one from it
    """

    null: FitResult
    final: FitResult
    hypotheses: tuple[Hypothesis, ...]
    alternatives: dict[str, dict[str, float]]
    unconverged: str
    log_odds: float
    random_effects: tuple[VarianceComponent, ...] = ()
    reduced_costs: dict[str, float] = field(default_factory=dict)
    uncertain: frozenset[str] = frozenset()
    trace: tuple[SearchStep, ...] = ()
    noise: Mapping[str, ChannelNoise] = field(default_factory=dict)
    regularities: Sequence[Regularity] = ()
    margins: Mapping[str, float] = field(default_factory=dict)

    @property
    def gained(self) -> float:
        """Fall of the cost with the accepted effects, and evidence of the random ones [1]."""
        random = sum(one.evidence for one in self.random_effects)
        return self.null.cost - self.final.cost + random

    @property
    def named(self) -> tuple[str, ...]:
        """Names of all accepted effects, the random ones first."""
        return (*(one.effect for one in self.random_effects), *self._followed)

    @property
    def _followed(self) -> tuple[str, ...]:
        """The accepted effects of the final fit."""
        return tuple(e for e in self.final.effects if e not in self.uncertain)

    def evidence(self, hypothesis: Hypothesis) -> float:
        """Evidence of an effect [1]: beside the other accepted effects, or alone."""
        for one in self.random_effects:
            if one.effect == hypothesis.effect:
                return one.evidence
        if hypothesis.effect in self.reduced_costs:
            fall = self.reduced_costs[hypothesis.effect] - self.final.cost
            return evidence_of(fall, self.final, self.null)
        if hypothesis.fit is None:
            return 0.0
        best = min(self.final, hypothesis.fit, key=lambda p: p.mean_square)
        return evidence_of(self.null.cost - hypothesis.fit.cost, best, self.null)

    def classes(self) -> list[list[str]]:
        """Classes of effects that these logs cannot tell apart, each led by an accepted effect."""
        found = [[one.effect] for one in self.random_effects]
        for name in self._followed:
            margin = self.margins.get(name, CLASS_MARGIN)
            costs = sorted(self.alternatives.get(name, {}).items(), key=lambda pair: pair[1])
            near = [
                other
                for other, cost in costs
                if other != name
                and evidence_of(cost - self.final.cost, self.final, self.null) < margin
            ]
            found.append([name, *near])
        return found
