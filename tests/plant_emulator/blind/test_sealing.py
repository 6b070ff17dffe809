"""The commitment to the truth of a case."""

import json
from pathlib import Path

import pytest

from plant_emulator.blind.sealing import seal, unseal
from plant_emulator.errors import EmulatorError, InputError
from plant_emulator.workflows.blind_trial.folder import Folder
from tests.plant_emulator.blind.conftest import case_with, finished, hidden

CASE = case_with(hidden("torque_sensor_offset", "torque_sensor", offset=0.5))


def test_what_was_sealed_comes_out() -> None:
    text, commitment = seal(CASE, "nonce")
    assert unseal(text, commitment, "here") == CASE


def test_changed_answer_is_refused() -> None:
    text, commitment = seal(CASE, "nonce")
    with pytest.raises(EmulatorError, match=r"here: SHA-256 .* the answer has been changed"):
        unseal(text.replace("0.5", "0.7"), commitment, "here")


def test_commitment_does_not_reveal_the_answer() -> None:
    """Another nonce gives another hash of the same truth."""
    assert seal(CASE, "one")[1] != seal(CASE, "two")[1]


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
        (2, "program", "a trial of seed 1; seed 1 continues it"),
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
    with pytest.raises(InputError, match="not empty and not a trial"):
        Folder(folder, 1, "program")


@pytest.mark.parametrize("text", ["", "[]", '{"schema": "blind-trial-manifest/1"}'])
def test_broken_manifest_is_refused(folder: Path, text: str) -> None:
    folder.mkdir()
    (folder / "manifest.json").write_text(text)
    with pytest.raises(InputError, match=r"manifest\.json: not a manifest of a trial"):
        Folder(folder, 1, "program")


def test_result_is_kept_and_a_damaged_one_refused(folder: Path) -> None:
    trial, result = Folder(folder, 1, "program"), finished(0, right=True)
    assert trial.read_result(0) is None
    trial.write_result(0, result, {"schema": "gap-diagnosis/1"})
    assert trial.read_result(0) == result
    (folder / "results" / "case_001.json").write_text('{"detail": ')
    with pytest.raises(EmulatorError, match=r"case_001\.json: damaged"):
        trial.read_result(0)
