"""The result of an identification as JSON, as text, and as a parameter set."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.identification.experiment_design import Experiment
    from plant_emulator.identification.identify import EstimatedParameter, Identification
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.simulation.fit_metrics import ChannelFit, LogComparison

# Correlation from which on a pair of parameters is reported as hardly separable.
CORRELATED = 0.95
# A standard error or condition number that says nothing but "not at all".
NOT_AT_ALL = 1e15


def to_json(
    found: Identification,
    fitted: Sequence[LogComparison],
    held_out: Sequence[LogComparison],
    *,
    experiments: Sequence[Experiment],
    notes: Sequence[str],
    cpu_seconds: float,
) -> dict[str, Any]:
    """The document `identification/1`."""
    return {
        "schema": "identification/1",
        "parameters": [
            {
                "name": p.name,
                "value": p.value,
                "standard_error": finite(p.standard_error),
                "unit": p.unit,
                "identifiable": p.identifiable,
                "nominal": p.nominal,
            }
            for p in found.parameters
        ],
        "condition_number": finite(found.estimate.condition_number),
        "correlated": [list(pair) for pair in correlated_pairs(found)],
        "chi_squared": found.chi_squared,
        "start_in_gap": list(found.gap_positions),
        "experiments": [
            {
                "parameter": e.parameter,
                "program": e.program,
                "standard_error": finite(e.standard_error),
                "enough": e.enough,
            }
            for e in experiments
        ],
        "estimation": fits_to_json(fitted),
        "held_out": fits_to_json(held_out),
        "notes": list(notes),
        "simulations": found.estimate.simulations,
        "cpu_seconds": cpu_seconds,
        "converged": found.estimate.converged,
    }


def finite(value: float) -> float | None:
    """The number, or null where it is no information: JSON knows no infinity."""
    return value if value < NOT_AT_ALL else None


def fits_to_json(comparisons: Sequence[LogComparison]) -> dict[str, dict[str, dict[str, float]]]:
    """Val1, Val2 and NRMSD by log and channel, as in the documents of both commands."""
    return {
        source: {
            name: {"val1": fit.val1, "val2": fit.val2, "nrmsd": fit.nrmsd}
            for name, fit in one.fits.items()
        }
        for source, one in zip(distinct([c.source for c in comparisons]), comparisons, strict=True)
    }


def distinct(names: Sequence[str]) -> list[str]:
    """The names, each made distinct from equal names before it: `log`, `log (2)`."""
    found: list[str] = []
    for name in names:
        number = 1 + sum(one == name for one in names[: len(found)])
        found.append(name if number == 1 else f"{name} ({number})")
    return found


def correlated_pairs(found: Identification) -> list[tuple[str, str, float]]:
    """Pairs of parameters with a correlation beyond CORRELATED, and the correlation."""
    names, matrix = [p.name for p in found.parameters], found.estimate.correlation
    return [
        (names[i], names[j], float(matrix[i, j]))
        for i in range(len(names))
        for j in range(i)
        if abs(matrix[i, j]) > CORRELATED
    ]


def lines(
    found: Identification,
    fitted: Sequence[LogComparison],
    held_out: Sequence[LogComparison],
    experiments: Sequence[Experiment],
) -> list[str]:
    """The answer for the terminal."""
    rows = [f"{'parameter':24}{'value':>12}{'std error':>12}{'change':>9}  unit"]
    rows += [_row(p) for p in found.parameters]
    rows += [
        f"  {a} and {b} can hardly be told apart (correlation {r:.2f})"
        for a, b, r in correlated_pairs(found)
    ]
    rows += [_advice(e) for e in experiments]
    rows += [f"residual: {found.chi_squared**0.5:.2f} times the noise of the logs"]
    if found.chi_squared > 1.5:
        rows += ["  the model lacks something that these logs show: see plant-emulator diagnose"]
    for title, comparisons in (("fitted", fitted), ("held out", held_out)):
        for one in comparisons:
            rows += [f"{one.source} ({title})", *fit_rows(one.fits)]
    return rows


def _row(p: EstimatedParameter) -> str:
    change = 100.0 * (p.value / p.nominal - 1.0)
    row = f"{p.name:24}{p.value:12.5g}{p.standard_error:12.3g}{change:+8.2f}%  {p.unit}"
    if p.at_bound:
        return f"{row}  AT THE END of its range: check units and signs"
    return row if p.identifiable else f"{row}  NOT DETERMINED by these logs"


def _advice(e: Experiment) -> str:
    if e.enough:
        return f"  {e.parameter}: {e.program} as well would bring it to +-{e.standard_error:.2g}"
    return (
        f"  {e.parameter}: no drive program determines it (best: {e.program}, standard error "
        f"{e.standard_error:.2g}); measure it otherwise, or leave it fixed"
    )


def fit_rows(fits: Mapping[str, ChannelFit]) -> list[str]:
    """Val1, Val2, NRMSD and rms of every channel of a log, for the terminal."""
    rows = [f"  {'channel':18}{'Val1 %':>9}{'Val2 %':>9}{'NRMSD %':>10}{'rms':>11}"]
    return rows + [
        f"  {name:18}{fit.val1:9.3f}{fit.val2:9.3f}{100 * fit.nrmsd:10.4f}{fit.rms:11.4g}"
        for name, fit in fits.items()
    ]


def fit_table(comparisons: Sequence[LogComparison]) -> str:
    """The measures as CSV text, a row a channel of a log."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["log", "channel", "val1_percent", "val2_percent", "nrmsd_percent", "rms_SI"])
    for one in comparisons:
        for name, fit in one.fits.items():
            writer.writerow([one.source, name, fit.val1, fit.val2, 100.0 * fit.nrmsd, fit.rms])
    return out.getvalue()


def parameter_table(found: Identification) -> str:
    """The parameters as CSV text."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["parameter", "value", "standard_error", "unit", "before", "determined"])
    for p in found.parameters:
        determined = "yes" if p.identifiable else "no"
        writer.writerow([p.name, p.value, p.standard_error, p.unit, p.nominal, determined])
    return out.getvalue()


def parameter_set(
    found: Identification, hashes: Mapping[str, str], *, date: str, version: str
) -> ParameterSet:
    """The set to save: values with standard errors, and where they come from.

    hashes : SHA-256 of every estimation log by its name
    """
    source = f"identified {date} from {len(hashes)} logs, see [origin]"
    new = dict(found.parameter_set.parameters)
    for p in found.parameters:
        new[p.name] = replace(
            new[p.name],
            source=source,
            standard_error=p.standard_error if finite(p.standard_error) is not None else None,
        )
    origin = {
        "date": date,
        "version": version,
        "before": found.parameter_set.name,
        "logs": [f"{name} sha256:{digest}" for name, digest in hashes.items()],
        "free": [p.name for p in found.parameters],
        "not_determined": [p.name for p in found.parameters if not p.identifiable],
        "converged": found.estimate.converged,
        "residual_over_noise": round(found.chi_squared**0.5, 4),
    }
    return replace(found.parameter_set, parameters=new, origin=origin)
