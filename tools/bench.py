#!/usr/bin/env python3
"""Compare the emulator's speed with general solvers at the same error: a table, and bench/1.

Each row is processor time, measured in this run, in turns with its peer. Everything is compiled
beforehand. ratio = peer / ours. A row holds where its ratio reaches its target. A row with target 0
is for information.

The error of a solution is the NRMSD of its worst channel on program 1, against a converged
solution. An independent solver has to agree with that one. We run at the loosest tolerance from
which on our error stays below a bound. The peer runs at its fastest tolerance, among those at which
its error is at most a quarter larger than ours.

The ticks of the gateway are wall time, in real time beside the emulator: quantiles of 15 s each.

The diagnosis is the whole command on all cores, run once, against a budget of wall time. Its growth
with logs and effects is the processor time of all its processes.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict

import click
from benchmark.comparisons import GROUPS, Row
from benchmark.study import Study

SCHEMA = "bench/1"


def figure(value: float | None, unit: str) -> str:
    """A number of three digits with its unit."""
    if value is None:
        return "-"
    if unit == "s" and value < 1.0:
        return f"{1e3 * value:.3g} ms" if value >= 1e-3 else f"{1e6 * value:.3g} us"
    return f"{value:.3g} {unit}"


def line(row: Row) -> str:
    """The text of a row."""
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
