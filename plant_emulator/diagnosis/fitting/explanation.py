"""What a contest between effects came to, and how much its fits are worth.

Evidence is the fall of the penalised sum of squares, over the mean square that the better model
leaves (at least 1, the noise), times the share of its samples that are independent. A model that
leaves much more than the noise leaves something correlated, which makes wrong effects count; its
share is then taken no larger than that of the fit without effects.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant_emulator.diagnosis.fitting.joint_fit import Point
    from plant_emulator.diagnosis.fitting.random_effects import Unrest

# Evidence from which on an effect counts.
THRESHOLD = 25.0
# Effects whose evidence differs by less cannot be told apart: odds of 150 to 1.
MARGIN = 10.0
# Drift-free signature at its plausible size from which on an effect is detectable, in the noise.
DETECTABLE = 7.0
# What the noise of a log is known to, as a part of its square.
NOISE_KNOWN = 0.02
# Share of the gap that may be left for the cause to be known. What a law slightly other than the
# library's left was up to 0.17; effects that are not in it left 0.4 and more with the best that is.
LEFT = 0.2
# Mean square up to which a model leaves nothing but noise.
NOISE_LEFT = 1.05
# Structure of a residual from which on it is no noise [chi squared].
STRUCTURED = 200.0
# Mean square from which on a model leaves more than what the noise explains.
MISFIT = 1.5


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
    point: Point | None


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

    null: Point
    final: Point
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


def weighed(fall: float, better: Point, null: Point) -> float:
    """Evidence of a fall of the cost, see the module's text."""
    share = better.share
    if better.chi_squared > MISFIT:
        share = min(share, null.share)
    return max(0.0, fall) / max(1.0, better.chi_squared) * share


def excess(point: Point) -> float:
    """Sum of squares beyond what the noise explains."""
    return max(0.0, point.squares - (1.0 + NOISE_KNOWN) * point.samples)


def evident(point: Point, null: Point) -> bool:
    """Whether a fit with effects explains more than chance does."""
    return weighed(null.cost - point.cost, point, null) >= THRESHOLD


def adequate(point: Point, null: Point) -> bool:
    """Whether a model leaves so little of the gap that its cause is known."""
    return excess(point) <= max(LEFT * excess(null), THRESHOLD)
