"""The effects of one round of a contest against each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import NOISE_MEAN_SQUARE, excess
from plant_emulator.diagnosis.fitting.explanation import Hypothesis

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.signature import Signature

# What keeps an effect in a round: the fall of its cost [fall of the best one], more of it beside
# one that leaves nothing but noise, or that it is no further behind the best than a first look may
# be wrong [chi squared].
KEPT, KEPT_BESIDE_NOISE, NEAR = 0.25, 0.5, 50.0


def explained(contenders: Sequence[Hypothesis]) -> bool:
    """Whether an effect leaves nothing but noise."""
    return any(point.mean_square <= NOISE_MEAN_SQUARE for point in points_of(contenders))


def closed(contenders: Sequence[Hypothesis], base: FitResult, share: float) -> bool:
    """Whether an effect closes so much of what a fit leaves beyond the noise."""
    return any(excess(point) <= (1.0 - share) * excess(base) for point in points_of(contenders))


def contender_of(name: str, shown: Signature | None, point: FitResult | None) -> Hypothesis:
    """An effect after its first look."""
    if shown is None:
        return Hypothesis(
            effect=name, orthogonal_norm=0.0, total_norm=0.0, confounded_with="", fit=None
        )
    return Hypothesis(
        effect=name,
        orthogonal_norm=shown.orthogonal_norm,
        total_norm=shown.total_norm,
        confounded_with=shown.confounded_with,
        fit=point,
    )


def beside(point: FitResult, base: FitResult) -> Hypothesis:
    """The effect that a fit has beside those of another."""
    (name,) = set(point.effects) - set(base.effects)
    return Hypothesis(
        effect=name, orthogonal_norm=0.0, total_norm=0.0, confounded_with="", fit=point
    )


def better_of(first: Sequence[Hypothesis], second: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Each effect with the better of its two fits."""
    others = {c.effect: c for c in second if c.fit is not None}
    return [min(c, others.get(c.effect, c), key=cost_of) for c in first]


def best_few(contenders: Sequence[Hypothesis], base: FitResult, most: int) -> list[Hypothesis]:
    """Those whose cost is least, without those that fall far behind the best."""
    order = sorted(with_point(contenders), key=cost_of)
    if not order:
        return []
    least = cost_of(order[0])
    kept = KEPT_BESIDE_NOISE if explained(order[:1]) else KEPT
    reach = max(least + NEAR, base.cost - kept * (base.cost - least))
    return [c for c in order[:most] if cost_of(c) <= reach]


def cost_of(contender: Hypothesis) -> float:
    """Cost of an effect's fit; infinite where the effect does not show."""
    return contender.fit.cost if contender.fit is not None else float("inf")


def least_cost(contenders: Sequence[Hypothesis]) -> float:
    """Least cost of all fits; infinite where no effect shows."""
    return min(map(cost_of, contenders), default=float("inf"))


def with_point(contenders: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Those that show."""
    return [c for c in contenders if c.fit is not None]


def points_of(contenders: Sequence[Hypothesis]) -> Iterator[FitResult]:
    """The fits of those that show."""
    return (c.fit for c in contenders if c.fit is not None)


def best_of(contenders: Sequence[Hypothesis]) -> FitResult | None:
    """The fit whose cost is least; None where no effect shows.

    Beside another one that has to have a size: what else differs from run to run is left of a law
    slightly other than the library's as well.
    """
    sure = [p for p in points_of(contenders) if len(p.effects) == 1 or not p.insignificant]
    return min(sure, key=lambda p: p.cost, default=None)


def costs_of(contenders: Sequence[Hypothesis]) -> dict[str, float]:
    """The cost of those that show, by effect."""
    return {c.effect: c.fit.cost for c in contenders if c.fit is not None}
