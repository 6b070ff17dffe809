"""What a contest between effects came to, and how much its fits are worth.

Evidence is the fall of the penalised sum of squares, over the mean square that the better model
leaves (at least 1, the noise), times the share of its samples that are independent. A model that
leaves much more than the noise leaves something correlated, which makes wrong effects count; its
share is then taken no larger than that of the fit without effects.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import MARGIN, weighed

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fit_result import FitResult, Unrest


@dataclass(frozen=True, kw_only=True)
class Contender:
    """An effect in the contest.

    norm : of its drift-free signature at the plausible size; raw : without removing drift
    point : its joint fit; None where its signature vanishes, or promises nothing beyond noise
    """

    effect: str
    norm: float
    raw: float
    imitated_by: str
    point: FitResult | None


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """What the contest came to.

    null : the fit without effects; final : with those accepted
    contenders : of the first round, all effects of the library
    rivals : for every accepted effect the costs of all that took its place
    unconverged : why the answer cannot be trusted; empty where it can
    chance : effects whose course is chance, beside those of `final`
    without : of several accepted effects the least cost that a fit without it came to, by name
    """

    null: FitResult
    final: FitResult
    contenders: tuple[Contender, ...]
    rivals: dict[str, dict[str, float]]
    unconverged: str
    chance: tuple[Unrest, ...] = ()
    without: dict[str, float] = field(default_factory=dict)

    @property
    def named(self) -> tuple[str, ...]:
        """All effects accepted."""
        return (*(one.effect for one in self.chance), *self.final.effects)

    def evidence(self, contender: Contender) -> float:
        """Evidence of an effect alone; of one of several accepted, of it beside the others."""
        for one in self.chance:
            if one.effect == contender.effect:
                return one.evidence
        if contender.effect in self.without:
            fall = self.without[contender.effect] - self.final.cost
            return weighed(fall, self.final, self.null)
        if contender.point is None:
            return 0.0
        best = min(self.final, contender.point, key=lambda p: p.chi_squared)
        return weighed(self.null.cost - contender.point.cost, best, self.null)

    def classes(self) -> list[list[str]]:
        """For every accepted effect those that these logs cannot tell from it, itself first."""
        found = [[one.effect] for one in self.chance]
        for name in self.final.effects:
            costs = sorted(self.rivals.get(name, {}).items(), key=lambda pair: pair[1])
            near = [
                other
                for other, cost in costs
                if other != name and weighed(cost - self.final.cost, self.final, self.null) < MARGIN
            ]
            found.append([name, *near])
        return found
