"""The verdict: which effects the held-out runs confirm, and what is said where there are none."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.axis.leftover import FORCE_BEFORE, rest_of, rest_over
from plant_emulator.diagnosis.axis.motion.run import UNCERTAIN
from plant_emulator.diagnosis.axis.settings import SETTINGS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.diagnosis.answer import Kind
    from plant_emulator.diagnosis.axis.held_out import HeldOut, Share
    from plant_emulator.diagnosis.axis.known import KnownAxis
    from plant_emulator.diagnosis.axis.leftover import Rest
    from plant_emulator.diagnosis.axis.regression.fit import Fit, Regression
    from plant_emulator.diagnosis.axis.regression.rows import Rows
    from plant_emulator.diagnosis.axis.search import AxisSearch


@dataclass(frozen=True, kw_only=True)
class Decision:
    """Kind of the verdict, the fit behind it, and why there is no name.

    inertia : of each run that has another one: number, value and standard error
    """

    kind: Kind
    found: Fit
    reason: str = ""
    inertia: tuple[tuple[int, float, float], ...] = ()


def decide(
    search: AxisSearch,
    held_out: HeldOut,
    noise: float,
    floor: float,
    known: KnownAxis | None = None,
) -> Decision:
    """Decide by the held-out runs.

    noise, floor : rms of the force's error that the sensors' noise leaves, and repeats
    known : the parameter set, if there is one
    """
    found, reason = _confirmed(search, held_out)
    other = other_inertia(held_out.regression, held_out.rows)
    closed = held_out.share(found.terms, ()).value
    # Another inertia of a run looks like an effect, if it may not differ.
    own = held_out.own_inertia()
    if other and own.low > 0.0 and own.value > closed:
        return Decision(kind="parameter", found=search.null, inertia=other)
    if not found.terms:
        decision = _without_a_name(search, held_out, noise, floor, reason)
        if decision.kind == "none" and known and _has_other_values(known, search, held_out):
            return replace(decision, kind="parameter")
        return decision
    reason = _insufficient(found, held_out)
    if reason:
        return Decision(kind="unknown", found=search.null, reason=reason)
    return Decision(kind="effect", found=found)


def _has_other_values(known: KnownAxis, search: AxisSearch, held_out: HeldOut) -> bool:
    """Whether parameters differ from those of the set, and this closes a share of the error."""
    closed = held_out.recalibrated(known.values)
    return bool(known.deviating(search.null)) and _is_found(closed)


def _insufficient(found: Fit, held_out: HeldOut) -> str:
    """Why confirmed effects do not stand for the gap; empty where they do."""
    told = " and ".join(found.names)
    error = held_out.relative(found.terms)
    if error > 1.0:
        return f"with {told} the error is {100.0 * error:.0f} % of the force"
    inertia, deviation = found.values[0], np.sqrt(found.covariance[0, 0])
    if inertia <= UNCERTAIN * deviation:
        return f"no inertia is certain: {inertia:.3g} +- {deviation:.2g}"
    # A cause leaves noise, and a neighbour of the cause leaves a law.
    rest, closed = rest_of(held_out, found.terms), held_out.share(found.terms, ()).value
    more = rest.share.low > SETTINGS.worth and rest.share.value > closed
    # A delay and a lag are exact laws: beside them the force before has nothing left to say of the
    # gap. A command that is held for a part of a sample leaves a little, which is no other law.
    if any(term.effect.replaced for term in found.terms):
        before = rest_over(FORCE_BEFORE, held_out, found.terms)
        is_law = _is_found(before.share) and _of_gap(before, held_out, found) >= SETTINGS.worth
        rest, more = (before, True) if is_law else (rest, more)
    if more or rest.share.low > SETTINGS.systematic:
        return f"{told} closes {describe(closed)}, and {_described(rest)} beside it"
    return ""


def _of_gap(rest: Rest, held_out: HeldOut, found: Fit) -> float:
    """Rms of what a further law predicts beside a fit, in that of the error without effects [1]."""
    left = max(0.0, 1.0 - rest.share.value)
    predicted = held_out.relative(found.terms) * np.sqrt(max(0.0, 1.0 - left**2))
    return float(predicted / held_out.relative(()))


def _without_a_name(
    search: AxisSearch, held_out: HeldOut, noise: float, floor: float, reason: str
) -> Decision:
    """The verdict where no effect is confirmed; reason : why the best one is not."""
    found = search.null
    rest = rest_of(held_out, ())
    if _is_found(rest.share):
        return Decision(kind="unknown", found=found, reason=reason or _described(rest))
    plain, left = (
        float(np.mean(np.concatenate(held_out.errors((), timing=timing)) ** 2))
        for timing in (False, True)
    )
    if held_out.relative((), timing=True) <= SETTINGS.worth:
        return Decision(kind="none", found=found)
    # The friction of an axis that sticks looks like a force before, and is not worth a name.
    before = rest_over(FORCE_BEFORE, held_out, ())
    if _is_found(before.share):
        return Decision(kind="unknown", found=found, reason=reason or _described(before))
    if plain * SETTINGS.noisy < noise**2:
        reason = "what is left changes more from sample to sample than noise does"
    elif left <= SETTINGS.noisy * floor**2:
        return Decision(kind="none", found=found)
    reason = reason or "no effect of the library closes a share of it on the held-out runs"
    return Decision(kind="unknown", found=found, reason=reason)


def _confirmed(search: AxisSearch, held_out: HeldOut) -> tuple[Fit, str]:
    """The best set of which the held-out runs need every effect; else why the best one fails."""
    confirmed: dict[frozenset[str], Fit] = {}
    failing: dict[frozenset[str], str] = {}
    for found in _ranked(search)[: SETTINGS.beam]:
        for part in _parts(search, found):
            key = frozenset(part.names)
            if key not in failing:
                failing[key] = _failing(search, held_out, part)
            if not failing[key]:
                confirmed[key] = part
                break
    if not confirmed:
        singles = [part for part in _parts(search, search.best) if len(part.terms) == 1]
        return search.null, failing[frozenset(singles[0].names)] if singles else _doubted(search)
    # Sets of like evidence differ by what the held-out runs say, and these need every effect.
    least = min(map(search.value, confirmed.values())) + SETTINGS.margin
    like = [f for f in confirmed.values() if search.value(f) <= least]
    winner = min(like, key=lambda f: (-len(f.terms), search.value(f)))
    # A winner that came by taking effects back need not be one of those that the search believes.
    like = [f for f in search.alike(winner) if f is winner or not _failing(search, held_out, f)]
    return next(iter(like), winner), ""


def _parts(search: AxisSearch, found: Fit) -> list[Fit]:
    """A set and its parts, but the empty one and those without evidence; the largest one first."""
    parts = [p for k in range(len(found.names)) for p in combinations(found.names, k + 1)]
    found_parts = [part for part in map(search.fit_set, parts) if np.isfinite(search.value(part))]
    return sorted(found_parts, key=search.value)


def _ranked(search: AxisSearch) -> list[Fit]:
    """The sets that can be believed, the best first."""
    best = search.best
    return [best, *(f for f in search.believed() if f is not best)]


def _doubted(search: AxisSearch) -> str:
    """Why the single effect of the largest evidence cannot be believed; empty: there is none."""
    found = min((f for f in search.sets.values() if len(f.terms) == 1), key=search.value)
    return search.doubt(found, found.terms[0]) if search.gain(found) > 0.0 else ""


def _failing(search: AxisSearch, held_out: HeldOut, found: Fit) -> str:
    """Why the held-out runs do not confirm the effect of a set that they need least; empty: do."""
    worst: tuple[float, str] | None = None
    for term in found.terms:
        name = term.effect.name
        rest = search.fit_set([n for n in found.names if n != name]).terms
        shares = [held_out.share(found.terms, rest)]
        if term.effect.replaced is None:
            shares.append(held_out.share(found.terms, rest, timing=True))
        share = min(shares, key=lambda s: s.low)
        why = search.doubt(found, term)
        if not all(map(_is_found, shares)):
            why = f"the held-out runs do not confirm {name} ({describe(share.value)} closed)"
        if why and (worst is None or share.low < worst[0]):
            worst = (share.low, why)
    return "" if worst is None else worst[1]


def _is_found(share: Share) -> bool:
    """Whether the held-out runs confirm that something closes a share that is worth a name."""
    return share.value >= SETTINGS.worth and share.low > 0.0


def _described(rest: Rest) -> str:
    """What a law that is not in the library would close, as a part of a sentence."""
    return f"a law over {rest.state} that the library lacks closes {describe(rest.share.value)}"


def describe(share: float) -> str:
    """A share in percent."""
    return f"{100.0 * share:.1f} %"


def other_inertia(
    regression: Regression, rows: Sequence[Rows]
) -> tuple[tuple[int, float, float], ...]:
    """Runs whose inertia differs from that of the fitted runs, each with value and error."""

    def inertia(some: Sequence[Rows]) -> tuple[float, float]:
        found = replace(regression, rows=list(some)).fit(())
        return float(found.values[0]), float(np.sqrt(found.covariance[0, 0]))

    common = inertia(regression.rows)
    found = []
    for k, one in enumerate(rows):
        value, error = inertia([one])
        apart = abs(value - common[0])
        certain = apart > SETTINGS.sure * np.hypot(error, common[1]) and value > UNCERTAIN * error
        if certain and apart > SETTINGS.friction_spread * abs(common[0]):
            found.append((k, value, error))
    return tuple(found)
