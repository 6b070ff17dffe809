"""Diagnose labelled cases by the command, and print its answers beside the labels.

    .venv/bin/python tools/practice.py FOLDER
    .venv/bin/python tools/practice.py FOLDER --withhold
    .venv/bin/python tools/practice.py FOLDER --only practice_003

FOLDER holds labels.tsv (columns case, label, kind, subsystem) and the logs of each case as
CASE/program*.csv.gz. --withhold runs the cases with a single effect, and takes that effect out of
the library. The right answer is then `unknown` or another effect that leaves only noise.
"""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Mapping

# A held-out gap counts as noise up to this multiple of the noise floor, all channels together.
NOISE = 1.2
# A class with more effects than this says nothing.
LARGEST_CLASS = 3


@dataclass(frozen=True, kw_only=True)
class Case:
    """A labelled case: its effects, the kind of its right answer, and the subsystems of its gap."""

    name: str
    effects: frozenset[str]
    kind: str
    places: frozenset[str]


def cases_of(folder: Path) -> list[Case]:
    """The cases of labels.tsv."""
    with (folder / "labels.tsv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file, delimiter="\t"))
    return [
        Case(
            name=row["case"],
            effects=frozenset(row["label"].split("+") if row["kind"] == "effect" else ()),
            kind=row["kind"],
            places=frozenset(filter(None, row["subsystem"].split("|"))),
        )
        for row in rows
    ]


def left(answer: Mapping[str, Any]) -> dict[str, float]:
    """The held-out gap that the answer leaves, over the noise floor, by channel."""
    gap = answer["gap"]
    return {name: gap["explained"][name] / floor for name, floor in gap["noise_floor"].items()}


def right(case: Case, answer: Mapping[str, Any], *, withheld: bool) -> bool:
    """Whether the answer names every effect of the case, at the level of classes, and no other.

    withheld : the effect is not in the library; right is `unknown`, or an effect that leaves noise
    """
    verdict = answer["verdict"]
    if withheld:
        noise = (sum(x * x for x in left(answer).values()) / len(left(answer))) ** 0.5 <= NOISE
        return bool(verdict["kind"] == "unknown" or (verdict["kind"] == "effect" and noise))
    if verdict["kind"] != case.kind:
        return False
    classes = [set(names) for names in verdict["class"]]
    return len(classes) == len(case.effects) and all(
        any(name in names and len(names) <= LARGEST_CLASS for names in classes)
        for name in case.effects
    )


def is_located(case: Case, answer: Mapping[str, Any]) -> bool:
    """Whether the answer's subsystem is one of the label's; a label may ask for none."""
    return not case.places or answer["location"]["subsystem"] in case.places


def diagnose(folder: Path, case: Case, withheld: str | None) -> tuple[dict[str, Any], float]:
    """The answer of `plant-emulator diagnose` on one core, and its wall time [s]."""
    logs = sorted(str(path) for path in (folder / case.name).glob("program*.csv.gz"))
    options = ["--without", withheld] if withheld else []
    begun = perf_counter()
    with TemporaryDirectory() as scratch:
        file = Path(scratch) / "answer.json"
        command = [sys.executable, "-m", "plant_emulator", "diagnose", *logs, *options]
        command += ["--workers", "1", "--json", str(file)]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        if done.returncode != 0:
            raise click.ClickException(f"{case.name}: {done.stderr.strip()}")
        return json.loads(file.read_text()), perf_counter() - begun


def line(case: Case, answer: Mapping[str, Any], seconds: float, *, withheld: bool) -> str:
    """A row of the table."""
    verdict, closed = answer["verdict"], answer["gap"]["closed_fraction"]
    named = "+".join(verdict["effects"]) or verdict["kind"]
    over = left(answer)
    worst = max(over, key=over.__getitem__)
    cells = (
        case.name,
        "+".join(sorted(case.effects)) or case.kind,
        named,
        "right" if right(case, answer, withheld=withheld) else "WRONG",
        answer["location"]["subsystem"] or "-",
        "right" if is_located(case, answer) else "WRONG",
        "-" if closed is None else f"{100.0 * closed:.1f} %",
        f"{over[worst]:.2f} ({worst})",
        f"{seconds:.0f} s",
    )
    return f"| {' | '.join(cells)} |"


@click.command()
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--withhold",
    is_flag=True,
    help="Take the effect of each case with a single effect out of the library.",
)
@click.option("--only", metavar="CASE", help="Diagnose this case only.")
def main(folder: Path, *, withhold: bool, only: str | None) -> None:
    """Diagnose the labelled cases of FOLDER, one a core at a time."""
    if not (folder / "labels.tsv").is_file():
        raise click.UsageError(f"{folder}/labels.tsv: no such file; it says what each case hides")
    cases = [c for c in cases_of(folder) if only in (None, c.name)]
    if withhold:
        cases = [c for c in cases if len(c.effects) == 1]
    if not cases:
        raise click.UsageError(f"{folder}/labels.tsv: no case {only or 'with a single effect'}")
    click.echo("| case | hidden | answered | | place | | closed | most left, in the noise | time |")
    click.echo("|---|---|---|---|---|---|---|---|---|")
    found = []
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        names = [next(iter(c.effects)) if withhold else None for c in cases]
        for case, (answer, seconds) in zip(
            cases, pool.map(lambda c, name: diagnose(folder, c, name), cases, names), strict=True
        ):
            click.echo(line(case, answer, seconds, withheld=withhold))
            found.append((right(case, answer, withheld=withhold), is_located(case, answer)))
    named, there = (sum(column) for column in zip(*found, strict=True))
    click.echo(f"\nright: {named} of {len(found)}; in the right place: {there} of {len(found)}")


if __name__ == "__main__":
    main()
