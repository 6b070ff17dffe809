"""Commit and reveal: the hash of an answer is known before its case is diagnosed.

The hash covers the answer and a random nonce; without the nonce it could be guessed from the seed.
Who has the hashes of the manifest can check later that no answer was changed (R. Cramer, I.
Damgard, Commitment schemes and zero-knowledge protocols, 1999: commitment by a hash).
"""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any

from plant_emulator.blind.case import case_of
from plant_emulator.errors import EmulatorError

if TYPE_CHECKING:
    from plant_emulator.blind.case import Case


def sealed(case: Case, nonce: str) -> tuple[str, str]:
    """The text of a sealed answer, and its SHA-256."""
    text = json.dumps({"nonce": nonce, "case": case.as_json()}, sort_keys=True, indent=1)
    return text, sha256(text)


def opened(text: str, commitment: str, place: str) -> Case:
    """The case in a sealed answer; EmulatorError where it is not the one that was sealed."""
    if sha256(text) != commitment:
        raise EmulatorError(
            f"{place}: SHA-256 {sha256(text)[:16]}...; {commitment[:16]}... was sealed: the answer "
            "has been changed"
        )
    content: dict[str, Any] = json.loads(text)
    return case_of(content["case"])


def sha256(text: str) -> str:
    """Hash of a text."""
    return hashlib.sha256(text.encode()).hexdigest()
