#!/usr/bin/env python3
"""How fast the emulator is, next to general solvers at the same error: a table, and bench/1.

Every row is measured in this run, interleaved with what it is compared to, as CPU time, after
everything is compiled and warm. Errors are the worst channel's NRMSD on program 1 against a
converged solution, on which the independent solver has to agree. We run at the loosest tolerance
from which on our error stays below a bound; a peer at the one where it is fastest of all at which
it errs at most a quarter more than we do. ratio = peers / ours, and holds where it reaches the
target; target 0: for information. The diagnosis is the whole command on all cores, run once,
against its budget on the clock; its growth with logs and effects is CPU time of all processes.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict

import click
from comparisons import GROUPS, Row
from study import Study

SCHEMA = "bench/1"


def figure(value: float | None, unit: str) -> str:
    """A number with its unit, three digits."""
    if value is None:
        return "-"
    if unit == "s" and value < 1.0:
        return f"{1e3 * value:.3g} ms" if value >= 1e-3 else f"{1e6 * value:.3g} us"
    return f"{value:.3g} {unit}"


def line(row: Row) -> str:
    """One row of the table."""
    errors = [f"{e:.4f}" for e in (row.ours_error, row.peers_error) if e is not None]
    ratio = "-" if row.ratio is None else f"{row.ratio:.4g}"
    target = f">= {row.target:g}" if row.target else ""
    verdict = ("holds" if row.holds else "FAILS") if row.target else ""
    return (
        f"{row.name:<21} {figure(row.ours, row.unit):>9} {figure(row.peers, row.unit):>9} "
        f"{ratio:>9} {target:>8} {verdict:<6} {' / '.join(errors):<15} {row.peer}"
    )


HEAD = (
    f"{'row':<21} {'ours':>9} {'peer':>9} {'peer/ours':>9} {'target':>8} {'':<6} "
    f"{'error %':<15} compared with"
)


@click.command()
@click.option("--only", type=click.Choice(list(GROUPS)), multiple=True, help="Measure only these.")
@click.option("--json", "json_file", type=click.Path(allow_dash=True), help="Write bench/1 there.")
def main(only: tuple[str, ...], json_file: str | None) -> None:
    """Measure the emulator next to its peers."""
    study, rows, quiet = Study(), [], json_file == "-"
    if not quiet:
        click.echo(HEAD)
    for name in only or GROUPS:
        if sys.stderr.isatty():
            click.echo(f"\r{name} ... ", err=True, nl=False)
        for found in GROUPS[name](study):
            rows.append(found)
            if not quiet:
                click.echo(line(found))
    if json_file:
        with click.open_file(json_file, "w") as file:
            json.dump({"schema": SCHEMA, "rows": [asdict(found) for found in rows]}, file, indent=1)
            file.write("\n")
    sys.exit(0 if all(found.holds for found in rows) else 1)


if __name__ == "__main__":
    main()
