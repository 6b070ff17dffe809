"""No diagnosis changes a draft's file of another one."""

from pathlib import Path

import pytest

from plant_emulator.diagnosis.missing_law.law_search import Law
from plant_emulator.diagnosis.missing_law.quantity import LawQuantity
from plant_emulator.errors import InputError
from plant_emulator.workflows.diagnosis.draft_files import effect_files, present, remove_rejected


def law(size: float) -> Law:
    quantity = LawQuantity(place="gear", name="friction", unit="N m", hook="columns", states=())
    return Law(
        quantity=quantity, terms=(), coefficients=(size,), errors=(0.1,), gain=1.0, nuisance=()
    )


def text(name: str, own: Law) -> str:
    return f"{name}: {own.coefficients[0]}"


def test_file_of_another_law_is_another_file(tmp_path: Path) -> None:
    (first,) = effect_files([law(1.0)], text, tmp_path)
    second, again = effect_files([law(2.0), law(1.0)], text, tmp_path)
    assert again == first
    assert second != first
    assert first.read_text() == f"{first.stem}: 1.0"
    assert first.stem.startswith("draft_gear_")


def test_rejected_law_leaves_no_file_unless_it_was_there(tmp_path: Path) -> None:
    (saved,) = effect_files([law(1.0)], text, tmp_path)
    before = present(tmp_path)
    kept, rejected, known = effect_files([law(2.0), law(3.0), law(1.0)], text, tmp_path)
    remove_rejected([kept, rejected, known], [kept], before)
    assert known == saved
    assert present(tmp_path) == {saved, kept}


def test_folder_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "drafts").write_text("")
    with pytest.raises(InputError, match="drafts"):
        effect_files([law(1.0)], text, tmp_path / "drafts")
