"""The effect files of drafts.

A file is called by its place and its content. No diagnosis changes the file of another one, which a
saved parameter set may name.
"""

from __future__ import annotations

from hashlib import sha256
from typing import TYPE_CHECKING

from plant_emulator.errors import report_unwritable

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence
    from pathlib import Path

    from plant_emulator.diagnosis.missing_law.law_search import Law

# Digits of the content in a file's name.
DIGITS = 6


def effect_files(laws: Sequence[Law], text: Callable[[str, Law], str], folder: Path) -> list[Path]:
    """Paths of the effect files of laws, each written; text : of an effect, by name and law.

    Raises InputError where a file cannot be written.
    """
    return [_write(law, text, folder) for law in laws]


def _write(law: Law, text: Callable[[str, Law], str], folder: Path) -> Path:
    content = sha256(text("draft", law).encode()).hexdigest()[:DIGITS]
    file = (folder / f"draft_{law.quantity.place}_{content}.py").absolute()
    with report_unwritable(file):
        folder.mkdir(parents=True, exist_ok=True)
        file.write_text(text(file.stem, law), encoding="utf-8")
    return file


def present(folder: Path) -> set[Path]:
    """The effect files that are in a folder."""
    return set(folder.absolute().glob("*.py"))


def remove_rejected(files: Collection[Path], kept: Collection[Path], before: set[Path]) -> None:
    """Remove the files of laws that no draft holds, except those that were there before."""
    for file in {*files} - {*kept} - before:
        file.unlink()
