"""The answer of an axis: verdict, held-out gap, ranking, and what these logs cannot show."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.answer import (
    Answer,
    HeldOutGap,
    Location,
    Logs,
    ParameterDeviation,
    RankedEffect,
    Undetectable,
    Verdict,
)
from plant_emulator.diagnosis.axis.findings import nominal_errors, remainder
from plant_emulator.diagnosis.axis.quantities import UNITS, quantities
from plant_emulator.diagnosis.axis.regression.fit import NAMES
from plant_emulator.diagnosis.prediction.gap import OPEN_GAP
from plant_emulator.diagnosis.prediction.remainder import describe_band, describe_fall
from plant_emulator.diagnosis.wording import number

if TYPE_CHECKING:
    from plant_emulator.diagnosis.axis.findings import AxisFindings
    from plant_emulator.diagnosis.axis.regression.fit import Fit
    from plant_emulator.diagnosis.axis.regression.rows import Term
    from plant_emulator.diagnosis.axis.search import AxisSearch

# Effects of a ranking that are predicted and shown.
SHOWN = 6


def answer(f: AxisFindings) -> Answer:
    """The whole answer."""
    gap = _gap(f)
    return Answer(
        logs=Logs(
            estimation=tuple(f.sources[k] for k in f.fitted),
            held_out=tuple(dict.fromkeys(f.sources[k] for k in f.held_out.runs)),
        ),
        verdict=_verdict(f),
        location=_location(f),
        gap=gap,
        ranking=_ranking(f),
        undetectable=_undetectable(f),
        trace=tuple(f.search.trace),
    )


def _verdict(f: AxisFindings) -> Verdict:
    d = f.decision
    return Verdict(
        kind=d.kind,
        effects=tuple(t.effect.name for t in f.terms),
        classes=tuple(
            (t.effect.name, *f.search.alternatives(d.found, t.effect.name)) for t in f.terms
        ),
        parameters=_deviations(f),
        confidence=None,
        statement=_statement(f),
        next_experiment=_next(f),
    )


def _next(f: AxisFindings) -> str | None:
    """The channel that an unknown cause asks for first."""
    if f.decision.kind != "unknown" or f.search.regression.rows[0].run.log.load is not None:
        return None
    column = "load_torque_Nm" if f.rotary else "load_force_N"
    return f"log the external load ({column}): a load that is missing in the logs looks like this"


def _deviations(f: AxisFindings) -> tuple[ParameterDeviation, ...]:
    """Parameters that differ from the set, and inertias of single runs from the fitted runs'."""
    units, fit = UNITS[f.rotary], f.decision.found
    other = f.known.deviating(fit) if f.known else ()
    shifted = tuple(
        ParameterDeviation(
            name=name,
            nominal=f.known.values[k],
            estimated=float(fit.values[k]),
            standard_error=float(np.sqrt(fit.covariance[k, k])),
            unit=units[name],
        )
        for k, name in enumerate(NAMES)
        if f.known and name in other
    )
    return shifted + tuple(
        ParameterDeviation(
            name="inertia",
            nominal=float(f.search.null.values[0]),
            estimated=value,
            standard_error=error,
            unit=units["inertia"],
        )
        for _, value, error in f.decision.inertia
    )


def _statement(f: AxisFindings) -> str:
    d, rest = f.decision, remainder(f)
    match d.kind:
        case "effect":
            named = " and ".join(_named(f, t) for t in f.terms)
            them = "it" if len(f.terms) == 1 else "them"
            return (
                f"The machine has what the model lacks: {named}; with {them} "
                f"{describe_fall(rest)}; {describe_band(rest)}."
            )
        case "parameter" if not d.inertia:
            told = ", ".join(
                f"{p.name} {number(p.nominal, 4)} -> {number(p.estimated, 4)} {p.unit}"
                for p in _deviations(f)
            )
            return (
                f"The equations hold with other values than the set: {told}; no further effect is "
                "needed."
            )
        case "parameter":
            first = d.inertia[0]
            change = 100.0 * (first[1] / float(f.search.null.values[0]) - 1.0)
            return (
                f"The equations hold with other values: the inertia of {f.sources[first[0]]} is "
                f"{change:+.1f} %; no unmodelled effect is needed."
            )
        case "none":
            return (
                f"The logs show no gap worth a name: the held-out {f.channel} error "
                f"norm(e)/norm(y) is {100.0 * rest.before:.2f} %."
            )
    return (
        f"There is a gap whose cause is unknown: {d.reason}. Of the held-out {f.channel}, "
        f"{describe_band(rest)}."
    )


def _named(f: AxisFindings, term: Term) -> str:
    """An effect, what it is, and its values."""
    told = quantities(f.search.regression, f.decision.found, term)
    ways = [q for q in told if q.name in ("forwards", "backwards")]
    if ways:
        values = ", ".join(f"{number(q.value, 4)} {q.unit} {q.name}" for q in ways)
        return f"{term.effect.name} ({term.effect.title}: {values})"
    return f"{term.effect.name} ({term.effect.title})"


def _location(f: AxisFindings) -> Location:
    """The subsystems with the evidence that the best effect of each has."""
    falls: dict[str, float] = {}
    for found in _singles(f.search):
        (term,) = found.terms
        fall = max(0.0, f.search.null.cost - found.cost)
        falls[term.effect.subsystem] = max(fall, falls.get(term.effect.subsystem, 0.0))
    total = sum(falls.values())
    ordered = sorted(falls.items(), key=lambda one: -one[1])
    shares = {name: fall / total for name, fall in ordered if fall > 0.0}
    subsystem = None
    if f.decision.kind == "effect":
        subsystem = max((t.effect.subsystem for t in f.terms), key=lambda s: shares.get(s, 0.0))
    elif f.decision.kind == "parameter":
        subsystem = "load"
    elif f.decision.kind == "unknown":
        subsystem = next(iter(shares), "gear")
    return Location(subsystem=subsystem, channel=None, phase=None, shares=shares, cells=())


def _singles(search: AxisSearch) -> list[Fit]:
    """Fits with one effect that physics allows, the best first."""
    found = [f for f in search.sets.values() if len(f.terms) == 1 and isfinite(search.value(f))]
    return sorted(found, key=search.value)


def _gap(f: AxisFindings) -> HeldOutGap:
    """NRMSD of the force, and the share that the named effects close."""
    span = float(np.ptp(np.concatenate(f.held_out.measured())))
    before, after = (
        float(np.sqrt(np.mean(np.concatenate(f.held_out.errors(t)) ** 2))) for t in ((), f.terms)
    )
    closed, interval = None, None
    if f.terms and before >= OPEN_GAP * f.floor:
        share = f.held_out.share(f.terms, ())
        closed = _closed(before, after, f.floor)
        ends = [_closed(before, before * (1.0 - s), f.floor) for s in (share.low, share.high)]
        interval = (ends[0], ends[1])
    nominal = float(np.sqrt(np.mean(np.concatenate(nominal_errors(f)) ** 2)))
    return HeldOutGap(
        nominal={f.channel: nominal / span},
        recalibrated={f.channel: before / span},
        explained={f.channel: after / span},
        noise_floor={f.channel: f.floor / span},
        closed_fraction=closed,
        closed_fraction_ci95=interval,
    )


def _closed(before: float, after: float, floor: float) -> float:
    """Share of the gap beyond the floor that is closed [1]."""
    return 1.0 - max(0.0, (after / floor) ** 2 - 1.0) / ((before / floor) ** 2 - 1.0)


def _ranking(f: AxisFindings) -> tuple[RankedEffect, ...]:
    """The named effects, and the best others alone."""
    singles = {found.names[0]: found for found in _singles(f.search)}
    shown = [*dict.fromkeys([*(t.effect.name for t in f.terms), *list(singles)[:SHOWN]])]
    entries = []
    for name in shown:
        accepted = [t for t in f.terms if t.effect.name == name]
        found = f.decision.found if accepted else singles[name]
        term = accepted[0] if accepted else found.terms[0]
        alone = singles.get(name)
        gain = None
        if alone is not None:
            share = f.held_out.share(alone.terms, ())
            gain = 1.0 - (1.0 - share.value) ** 2
        entries.append(
            RankedEffect(
                effect=name,
                subsystem=term.effect.subsystem,
                evidence=2.0 * _evidence(f, found, name),
                held_out_gain=gain,
                parameters=quantities(f.search.regression, found, term),
                accepted=bool(accepted),
            )
        )
    return tuple(entries)


def _evidence(f: AxisFindings, found: Fit, name: str) -> float:
    """Log evidence of an effect beside the others of a fit."""
    rest = f.search.sets.get(frozenset(found.names) - {name}, f.search.null)
    return f.search.value(rest) - f.search.value(found)


def _undetectable(f: AxisFindings) -> tuple[Undetectable, ...]:
    """Effects that need what these runs do not have."""
    there = {e.name for e in f.search.candidates}
    missing = {e.name: e.needs for e in f.candidates if e.name not in there}
    return tuple(
        Undetectable(effect=name, reason=f"needs {needs}" if needs else "not in these runs")
        for name, needs in missing.items()
    )
