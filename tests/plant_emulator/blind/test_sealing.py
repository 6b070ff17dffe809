"""Answers are fixed before they are looked for."""

import json
from pathlib import Path

import pytest

from plant_emulator.blind.sealing import opened, sealed
from plant_emulator.errors import EmulatorError, InputError
from plant_emulator.workflows.blind_trial.folder import Folder
from tests.plant_emulator.blind.conftest import case_with, hidden

CASE = case_with(hidden("torque_sensor_offset", "torque_sensor", offset=0.5))


def test_what_was_sealed_comes_out() -> None:
    text, commitment = sealed(CASE, "nonce")
    assert opened(text, commitment, "here") == CASE


def test_changed_answer_is_refused() -> None:
    text, commitment = sealed(CASE, "nonce")
    with pytest.raises(EmulatorError, match=r"here: SHA-256 .* the answer has been changed"):
        opened(text.replace("0.5", "0.7"), commitment, "here")


def test_commitment_does_not_tell_the_answer() -> None:
    """The same answer has another hash with another nonce."""
    assert sealed(CASE, "one")[1] != sealed(CASE, "two")[1]


def test_manifest_holds_the_hash_and_nothing_of_the_answer(folder: Path) -> None:
    Folder(folder, 1, "program").seal([CASE])
    manifest = (folder / "manifest.json").read_text()
    assert len(json.loads(manifest)["cases"]["case_001"]) == 64
    assert "torque" not in manifest


def test_sealing_again_keeps_the_first_seal(folder: Path) -> None:
    Folder(folder, 1, "program").seal([CASE])
    before = (folder / "manifest.json").read_text()
    again = Folder(folder, 1, "program")
    again.seal([CASE])
    assert (folder / "manifest.json").read_text() == before
    assert again.unseal(0) == CASE


def test_answer_changed_on_disk_is_refused(folder: Path) -> None:
    trial = Folder(folder, 1, "program")
    trial.seal([CASE])
    file = folder / "sealed" / "case_001.json"
    file.write_text(file.read_text().replace("0.5", "0.7"))
    with pytest.raises(EmulatorError, match=r"case_001\.json: .* has been changed"):
        trial.unseal(0)


@pytest.mark.parametrize(
    ("seed", "program", "said"),
    [
        (2, "program", "a trial of seed 1; --seed 1 continues it"),
        (1, "another", "begun by another version of the program"),
    ],
)
def test_folder_of_another_trial_is_refused(
    folder: Path, seed: int, program: str, said: str
) -> None:
    Folder(folder, 1, "program").seal([CASE])
    with pytest.raises(InputError, match=said):
        Folder(folder, seed, program)


def test_folder_of_something_else_is_refused(folder: Path) -> None:
    folder.mkdir()
    (folder / "thesis.txt").write_text("mine")
    with pytest.raises(InputError, match="not empty, and no trial"):
        Folder(folder, 1, "program")


@pytest.mark.parametrize("text", ["", "[]", '{"schema": "blind-trial-manifest/1"}'])
def test_broken_manifest_is_refused(folder: Path, text: str) -> None:
    folder.mkdir()
    (folder / "manifest.json").write_text(text)
    with pytest.raises(InputError, match=r"manifest\.json: no manifest of a trial"):
        Folder(folder, 1, "program")


def test_result_is_kept_and_a_damaged_one_told(folder: Path) -> None:
    trial = Folder(folder, 1, "program")
    assert trial.kept(0) is None
    trial.keep(0, {"detail": {"right": True}})
    assert trial.kept(0) == {"detail": {"right": True}}
    (folder / "results" / "case_001.json").write_text('{"detail": ')
    with pytest.raises(EmulatorError, match=r"case_001\.json: damaged"):
        trial.kept(0)
