"""The folder of a trial.

    manifest.json         seed, hash of the program, SHA-256 of every sealed case
    sealed/case_001.json  truth of a case, with its nonce
    logs/case_001/*       logs for the diagnosis
    results/case_001.json result of a finished case, which is not repeated
    cases.csv             all cases as a table
    evidence.csv          data to calibrate the confidence

The manifest is complete before the first diagnosis starts. A file is written under a temporary name
and then renamed, so an interrupted trial leaves no incomplete file.
"""

from __future__ import annotations

import hashlib
import json
import secrets
from pathlib import Path
from typing import TYPE_CHECKING, Any

from plant_emulator.blind.result import result_from
from plant_emulator.blind.sealing import seal, sha256, unseal
from plant_emulator.errors import EmulatorError, InputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.blind.case import Case
    from plant_emulator.blind.result import CaseResult

SCHEMA = "blind-trial-manifest/1"
# Packages whose source decides the results of a trial.
PACKAGES = ("plant_emulator", "register_maps")
ROOT = Path(__file__).parents[3]


def program_hash() -> str:
    """SHA-256 of the program's source and data files."""
    state = hashlib.sha256()
    for package in PACKAGES:
        for file in sorted((ROOT / package).rglob("*")):
            if file.suffix in {".py", ".toml", ".csv"}:
                state.update(file.relative_to(ROOT).as_posix().encode() + file.read_bytes())
    return state.hexdigest()


class Folder:
    """The folder of a trial. A folder with a part of the trial is continued.

    program : SHA-256 of the program
    Raises InputError if the folder holds another trial or other files.
    """

    def __init__(self, path: Path, seed: int, program: str) -> None:
        self.path = path
        self._manifest = self._load_manifest(seed, program)
        for name in ("sealed", "logs", "results"):
            (path / name).mkdir(parents=True, exist_ok=True)

    def _load_manifest(self, seed: int, program: str) -> dict[str, Any]:
        """Manifest of the trial in the folder, or a new one."""
        file = self.path / "manifest.json"
        new = {"schema": SCHEMA, "seed": seed, "program_sha256": program, "cases": {}}
        if not file.is_file():
            if self.path.is_dir() and any(self.path.iterdir()):
                raise InputError(f"{self.path}: not empty and not a trial; give another folder")
            return new
        try:
            old: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
            there = (old["schema"], old["seed"], old["program_sha256"], dict(old["cases"]))
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(
                f"{file}: not a manifest of a trial ({error!r}); give another folder"
            ) from error
        if there[:2] != (SCHEMA, seed):
            raise InputError(
                f"{file}: a trial of seed {there[1]}; seed {there[1]} continues it, "
                "another folder begins a new one"
            )
        if there[2] != program:
            raise InputError(
                f"{file}: begun by another version of the program ({there[2][:12]}..., now "
                f"{program[:12]}...); continue with that version, or give another folder"
            )
        return old

    @property
    def manifest_hash(self) -> str:
        """SHA-256 of the manifest on disk."""
        return sha256((self.path / "manifest.json").read_text(encoding="utf-8"))

    def seal(self, cases: Sequence[Case]) -> None:
        """Seal the cases that are not sealed yet, and write all hashes to the manifest."""
        for case in cases:
            if _name(case.number) in self._manifest["cases"]:
                continue
            text, commitment = seal(case, secrets.token_hex(16))
            self._manifest["cases"][_name(case.number)] = commitment
            write(self._sealed_file(case.number), text)
        write(self.path / "manifest.json", json.dumps(self._manifest, indent=1))

    def unseal(self, number: int) -> Case:
        """Read the truth of a case. Raises EmulatorError if it differs from its commitment."""
        file = self._sealed_file(number)
        text = file.read_text(encoding="utf-8")
        return unseal(text, self._manifest["cases"][_name(number)], str(file))

    def _sealed_file(self, number: int) -> Path:
        return self.path / "sealed" / f"{_name(number)}.json"

    def logs(self, number: int) -> Path:
        """Folder of a case's logs."""
        folder = self.path / "logs" / _name(number)
        folder.mkdir(exist_ok=True)
        return folder

    def write_result(
        self, number: int, result: CaseResult, answer: Mapping[str, Any] | None
    ) -> None:
        """Write the result of a case with the JSON answer of its diagnosis."""
        data = {"detail": result.to_json(), "answer": answer}
        write(self._result_file(number), json.dumps(data, indent=1))

    def read_result(self, number: int) -> CaseResult | None:
        """Result of a case; None if the case is not finished. Raises EmulatorError if damaged."""
        file = self._result_file(number)
        if not file.is_file():
            return None
        try:
            return result_from(json.loads(file.read_text(encoding="utf-8"))["detail"])
        except (ValueError, KeyError, TypeError) as error:
            raise EmulatorError(f"{file}: damaged ({error}); delete it to repeat it") from error

    def _result_file(self, number: int) -> Path:
        return self.path / "results" / f"{_name(number)}.json"


def _name(number: int) -> str:
    """Name of a case; the first is case_001."""
    return f"case_{number + 1:03}"


def write(path: Path, text: str) -> None:
    """Write a file completely or not at all."""
    beside = path.with_name(f"{path.name}.part")
    beside.write_text(text, encoding="utf-8")
    beside.replace(path)
