"""Print and draw how often answers of a trial were right, over the confidence that they had.

    .venv/bin/python tools/reliability.py DIR/cases.csv --picture reliability.png
    .venv/bin/python tools/reliability.py

The cases of a trial have the confidence that the diagnosis gave them. Without a table they are the
cases that calibrate the confidence; that of each is computed from all the others. A bin holds as
many cases as the next one. Its interval is that of a binomial share (Clopper and Pearson, 95 %).
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np
from scipy.stats import binomtest

from plant_emulator.diagnosis.calibration.confidence import confidence
from plant_emulator.workflows.diagnosis.calibration import trial_cases

if TYPE_CHECKING:
    from collections.abc import Sequence

BINS = 4


def of_trial(table: Path) -> list[tuple[float, bool]]:
    """Confidence of each case of a trial that has one, and whether its answer is right."""
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return [(float(row["confidence"]), row["right"] == "True") for row in rows if row["confidence"]]


def of_calibration() -> list[tuple[float, bool]]:
    """Confidence of each case of the calibration by all the others."""
    cases = trial_cases()
    found = [confidence([*cases[:k], *cases[k + 1 :]], one) for k, one in enumerate(cases)]
    return [(c, one.right) for c, one in zip(found, cases, strict=True) if c is not None]


def draw(bins: Sequence[Sequence[tuple[float, bool]]], path: Path) -> None:
    """Draw the share of right answers of each bin over its mean confidence."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.5, 4.5), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color="#999999", linewidth=1, label="confidence = share")
    for one in bins:
        mean, share, low, high = summary(one)
        axes.errorbar(mean, share, [[share - low], [high - share]], fmt="o", color="#0072B2")
        axes.annotate(f"{len(one)}", (mean, share), (6, -12), textcoords="offset points")
    least = np.floor(10.0 * min(summary(one)[0] for one in bins)) / 10.0
    axes.set(xlabel="confidence", ylabel="share of right answers", xlim=(least, 1), ylim=(0, 1.02))
    axes.legend(loc="lower left", frameon=False)
    figure.savefig(path, dpi=120)


def summary(one: Sequence[tuple[float, bool]]) -> tuple[float, float, float, float]:
    """Mean confidence and share of right answers of a bin, with the share's 95 % interval."""
    hits = sum(right for _, right in one)
    interval = binomtest(hits, len(one)).proportion_ci()
    mean = float(np.mean([told for told, _ in one]))
    return mean, hits / len(one), float(interval.low), float(interval.high)


@click.command()
@click.argument(
    "table", required=False, type=click.Path(exists=True, dir_okay=False, path_type=Path)
)
@click.option("--picture", type=click.Path(dir_okay=False, path_type=Path), help="Draw it too.")
def main(table: Path | None, picture: Path | None) -> None:
    """Print the share of right answers of TABLE by confidence, and the Brier score."""
    told = sorted(of_trial(table) if table else of_calibration())
    if len(told) < BINS:
        raise click.ClickException(f"{len(told)} cases have a confidence; {BINS} are needed")
    bins = [[told[k] for k in part] for part in np.array_split(np.arange(len(told)), BINS)]
    for one in bins:
        mean, share, low, high = summary(one)
        click.echo(
            f"confidence {mean:5.1%}: {share:5.1%} of {len(one)} right ({low:.0%} to {high:.0%})"
        )
    score = np.mean([(confident - right) ** 2 for confident, right in told])
    share = np.mean([right for _, right in told])
    click.echo(f"Brier score {score:.3f}; of the share of all alone {share * (1.0 - share):.3f}")
    if picture is not None:
        draw(bins, picture)


if __name__ == "__main__":
    main()
