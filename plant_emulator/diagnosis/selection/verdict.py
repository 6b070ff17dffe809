"""What the hypothesis tests decide: an effect, other parameters, nothing, or unknown."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from plant_emulator.diagnosis.fitting.evidence import LJUNG_BOX_LIMIT, adequate, significant

if TYPE_CHECKING:
    from plant_emulator.diagnosis.answer import Kind
    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.diagnosis.fitting.explanation import Explanation
    from plant_emulator.diagnosis.machine import Model

# A parameter has shifted from so many of its own standard errors on.
SHIFTED = 3.0
# The same of a shift that is none by chance, of some ten parameters in a hundred diagnoses.
SURE = 4.0
# Mean square of the whitened residual up to which a model without effects leaves nothing but noise.
NOISE_ONLY = 1.1


@dataclass(frozen=True, kw_only=True)
class Deviation:
    """A parameter that left its nominal value; surprise : in prior standard deviations."""

    name: str
    nominal: float
    estimated: float
    standard_error: float
    unit: str
    subsystem: str
    surprise: float

    @property
    def significant(self) -> bool:
        """Whether chance does not explain it."""
        return abs(self.estimated - self.nominal) > SURE * self.standard_error


@dataclass(frozen=True, kw_only=True)
class Decision:
    """The kind of the verdict, its accepted effects, and the parameters that shifted.

    reason : why the cause is unknown; empty: it is known
    """

    kind: Kind
    effects: tuple[str, ...]
    deviations: tuple[Deviation, ...]
    reason: str


def deviations(model: Model, found: FitResult) -> tuple[Deviation, ...]:
    """Parameters more than SHIFTED standard errors from nominal: those that chance does not explain
    first, of these the most surprising.
    """
    moved = []
    for unknown in model.parameters:
        value, error = found.values[unknown.name], found.standard_errors[unknown.name]
        if abs(value - unknown.prior) <= SHIFTED * error:
            continue
        std = unknown.std if unknown.std is not None else abs(unknown.prior)
        moved.append(
            Deviation(
                name=unknown.name,
                nominal=unknown.prior,
                estimated=value,
                standard_error=error,
                unit=model.units[unknown.name],
                subsystem=model.subsystems[unknown.name],
                surprise=abs(value - unknown.prior) / std,
            )
        )
    return tuple(sorted(moved, key=lambda shift: (not shift.significant, -shift.surprise)))


def decide(model: Model, explained: Explanation) -> Decision:
    """The verdict of a contest."""
    found = _of_contest(model, explained)
    if explained.random_effects and found.kind != "unknown":
        return replace(found, kind="effect", effects=explained.named)
    return found


def _of_contest(model: Model, explained: Explanation) -> Decision:
    null, final = explained.null, explained.final
    moved = deviations(model, final)
    if explained.unconverged:
        return Decision(kind="unknown", effects=(), deviations=moved, reason=explained.unconverged)
    if model.reaches_noise and _structured(explained):
        reason = "what is left is as small as the noise, but not as random"
        return Decision(kind="unknown", effects=(), deviations=moved, reason=reason)
    if final.insignificant and not (len(final.effects) == 1 and significant(final, null)):
        name = final.insignificant[0]
        reason = f"it differs between the runs; {name} would do, but no size of it is certain"
        return Decision(kind="unknown", effects=(), deviations=moved, reason=reason)
    if final.effects and (adequate(final, null) or not model.reaches_noise):
        return Decision(kind="effect", effects=final.effects, deviations=moved, reason="")
    moved = deviations(model, null)
    if not final.effects and null.mean_square <= NOISE_ONLY:
        kind: Kind = "parameter" if any(shift.significant for shift in moved) else "none"
        return Decision(kind=kind, effects=(), deviations=moved, reason="")
    return Decision(
        kind="unknown",
        effects=(),
        deviations=moved,
        reason="no effect of the library, alone or with others, brings the residual to the noise",
    )


def _structured(explained: Explanation) -> bool:
    """Whether more structure is left than was explained, and more than noise has by chance.

    Of a model that leaves more than the noise the squares tell.
    """
    null, final = explained.null, explained.final
    small = adequate(final, null) if final.effects else null.mean_square <= NOISE_ONLY
    gained = null.cost - final.cost + sum(one.evidence for one in explained.random_effects)
    return small and final.ljung_box_excess > max(LJUNG_BOX_LIMIT, gained)
