"""The backward steps of a contest: every effect has to stand it again, and to be missed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import CLASS_MARGIN, NOISE_MEAN_SQUARE, evidence_of
from plant_emulator.diagnosis.selection.contenders import beside, best_of, costs_of, points_of
from plant_emulator.diagnosis.selection.rules import FAINT, MOST_EFFECTS, noise_only

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Hypothesis
    from plant_emulator.diagnosis.selection.rounds import Rounds


@dataclass(frozen=True)
class Backward:
    """The backward steps of one diagnosis.

    counts : whether a fit's last effect earns its place, by the fit, the one without that effect
        and the one without any
    """

    rounds: Rounds
    counts: Callable[[FitResult, FitResult, FitResult], bool]
    # Fits without one of their effects, by the fit: none is made twice.
    _refits: dict[object, FitResult] = field(default_factory=dict)

    def stand(
        self, final: FitResult, last: Sequence[Hypothesis]
    ) -> tuple[FitResult, dict[str, dict[str, float]]]:
        """Let every effect but the last stand the contest again; take the best in its place.

        Where another takes an effect's place, the rest have new company, and stand once more.
        """
        rivals = {final.effects[-1]: costs_of(last)}
        for _ in range(MOST_EFFECTS**2):
            waiting = [name for name in final.effects if name not in rivals]
            if not waiting:
                break
            without = self._without(final, waiting[0])
            known = final if noise_only(final) else None
            found = self.rounds.contend(without, thorough=False, known=known)
            best = best_of(found)
            if best is not None and best.cost < final.cost - CLASS_MARGIN:
                final, rivals = best, {best.effects[-1]: costs_of(found)}
            else:
                rivals[waiting[0]] = costs_of(found)
        return final, rivals

    def missed(self, final: FitResult, null: FitResult) -> tuple[FitResult, dict[str, float]]:
        """Without an effect that another has made needless; and the cost without each of several
        that are all needed, by name.

        Where one of two is faint, both are followed out of the hollow that they may lie in first.
        """
        found, without = self._needed(final, null)
        if not self._faint(found, null, without):
            return found, without
        return self._needed(self.rounds.restarts.followed(found, to_noise=False), null)

    def _needed(self, final: FitResult, null: FitResult) -> tuple[FitResult, dict[str, float]]:
        """A fit without an effect that another has made needless, as `missed` gives it."""
        costs: dict[str, float] = {}
        if len(final.effects) < 2:
            return final, costs
        for name in final.effects:
            without = self._without(final, name)
            if self.counts(final, without, null) and without.mean_square > NOISE_MEAN_SQUARE:
                without = self._alone(without, null)
            if not self.counts(final, without, null):
                return without, {}
            costs[name] = without.cost
        return final, costs

    def _without(self, final: FitResult, name: str) -> FitResult:
        """A fit without one of its effects, fitted again."""
        rest = tuple(e for e in final.effects if e != name)
        if (final.key, name) not in self._refits:
            found = self.rounds.restarts.refitted(replace(final, effects=rest))
            self._refits[final.key, name] = found
        return self._refits[final.key, name]

    def _alone(self, point: FitResult, null: FitResult) -> FitResult:
        """The fit with one effect, or that from the nominal parameters, where that is better."""
        found = self.rounds.nominal.fitted(null, [beside(point, null)])
        return min([point, *points_of(found)], key=lambda p: p.cost)

    def _faint(self, final: FitResult, null: FitResult, without: Mapping[str, float]) -> bool:
        """Whether one of two effects explains no more than what a fit may gain by leaving a hollow
        of its valley.
        """
        return noise_only(final) and any(
            evidence_of(cost - final.cost, final, null) < FAINT for cost in without.values()
        )
