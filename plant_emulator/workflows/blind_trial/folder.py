"""The folder of a trial on disk.

    manifest.json        seed, program, and the SHA-256 of every answer, before any is looked for
    sealed/case_001.json the answers, each with its nonce
    logs/case_001/*      the logs that the diagnosis gets
    results/case_001.json what became of a case: done cases are not done again
    cases.csv, evidence.csv    the outcome

A file is written beside its place and moved there: a trial that is interrupted leaves no half one.
"""

from __future__ import annotations

import hashlib
import json
import secrets
from pathlib import Path
from typing import TYPE_CHECKING, Any

from plant_emulator.blind.sealing import opened, sealed, sha256
from plant_emulator.errors import EmulatorError, InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from plant_emulator.blind.case import Case

SCHEMA = "blind-trial-manifest/1"
# The packages whose source decides what a trial gives.
PACKAGES = ("plant_emulator", "register_maps")
ROOT = Path(__file__).parents[3]


def program_hash() -> str:
    """SHA-256 of the program's source and its data."""
    state = hashlib.sha256()
    for package in PACKAGES:
        for file in sorted((ROOT / package).rglob("*")):
            if file.suffix in {".py", ".toml", ".csv"}:
                state.update(file.relative_to(ROOT).as_posix().encode() + file.read_bytes())
    return state.hexdigest()


class Folder:
    """A trial's folder; InputError where it holds another trial, or something else."""

    def __init__(self, path: Path, seed: int, program: str) -> None:
        self.path = path
        self._manifest = self._continued(seed, program)
        for name in ("sealed", "logs", "results"):
            (path / name).mkdir(parents=True, exist_ok=True)

    def _continued(self, seed: int, program: str) -> dict[str, Any]:
        """The manifest of the trial that the folder holds, or a new one."""
        file = self.path / "manifest.json"
        new = {"schema": SCHEMA, "seed": seed, "program_sha256": program, "cases": {}}
        if not file.is_file():
            if self.path.is_dir() and any(self.path.iterdir()):
                raise InputError(f"{self.path}: not empty, and no trial; give another --out")
            return new
        try:
            old: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
            there = (old["schema"], old["seed"], old["program_sha256"], dict(old["cases"]))
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(
                f"{file}: no manifest of a trial ({error!r}); give another --out"
            ) from error
        if there[:2] != (SCHEMA, seed):
            raise InputError(
                f"{file}: a trial of seed {there[1]}; --seed {there[1]} continues it, "
                "another --out begins a new one"
            )
        if there[2] != program:
            raise InputError(
                f"{file}: begun by another version of the program ({there[2][:12]}..., now "
                f"{program[:12]}...); go on with that one, or give another --out"
            )
        return old

    @property
    def manifest_hash(self) -> str:
        """SHA-256 of the manifest as it stands on disk."""
        return sha256((self.path / "manifest.json").read_text(encoding="utf-8"))

    def seal(self, cases: Sequence[Case]) -> None:
        """Seal what is not sealed yet, and publish all hashes in the manifest."""
        for case in cases:
            if _name(case.number) in self._manifest["cases"]:
                continue
            text, commitment = sealed(case, secrets.token_hex(16))
            self._manifest["cases"][_name(case.number)] = commitment
            write(self._sealed(case.number), text)
        write(self.path / "manifest.json", json.dumps(self._manifest, indent=1))

    def unseal(self, number: int) -> Case:
        """The answer of a case; EmulatorError where it is not what was sealed."""
        file = self._sealed(number)
        text = file.read_text(encoding="utf-8")
        return opened(text, self._manifest["cases"][_name(number)], str(file))

    def _sealed(self, number: int) -> Path:
        return self.path / "sealed" / f"{_name(number)}.json"

    def logs(self, number: int) -> Path:
        """The folder of a case's logs."""
        folder = self.path / "logs" / _name(number)
        folder.mkdir(exist_ok=True)
        return folder

    def keep(self, number: int, result: dict[str, Any]) -> None:
        """Write what became of a case."""
        write(self._result(number), json.dumps(result, indent=1))

    def kept(self, number: int) -> dict[str, Any] | None:
        """What became of a case; None: it is still to be done."""
        file = self._result(number)
        if not file.is_file():
            return None
        try:
            found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        except ValueError as error:
            raise EmulatorError(f"{file}: damaged ({error}); delete it to do it again") from error
        return found

    def _result(self, number: int) -> Path:
        return self.path / "results" / f"{_name(number)}.json"


def _name(number: int) -> str:
    """Name of a case, counted from 1."""
    return f"case_{number + 1:03}"


def write(path: Path, text: str) -> None:
    """Write a file as a whole or not at all."""
    beside = path.with_name(f"{path.name}.part")
    beside.write_text(text, encoding="utf-8")
    beside.replace(path)
