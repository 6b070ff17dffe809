"""Commitment to the truth of a case: its hash is published before the case is diagnosed.

The hash covers the truth and a random nonce. Without the nonce, the seed would reveal the truth.
The published hashes prove later that no truth was changed (commitment by a hash: R. Cramer,
I. Damgard, Commitment schemes and zero-knowledge protocols, 1999).
"""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any

from plant_emulator.blind.case import case_of
from plant_emulator.errors import EmulatorError

if TYPE_CHECKING:
    from plant_emulator.blind.case import Case


def seal(case: Case, nonce: str) -> tuple[str, str]:
    """Text that holds case and nonce, and its SHA-256 (the commitment)."""
    text = json.dumps({"nonce": nonce, "case": case.to_json()}, sort_keys=True, indent=1)
    return text, sha256(text)


def unseal(text: str, commitment: str, place: str) -> Case:
    """Read the case from a sealed text.

    place : name of the file, for the error
    Raises EmulatorError if the text does not match its commitment.
    """
    if sha256(text) != commitment:
        raise EmulatorError(
            f"{place}: SHA-256 {sha256(text)[:16]}...; {commitment[:16]}... was sealed: the answer "
            "has been changed"
        )
    content: dict[str, Any] = json.loads(text)
    return case_of(content["case"])


def sha256(text: str) -> str:
    """SHA-256 of a text, in hexadecimal digits."""
    return hashlib.sha256(text.encode()).hexdigest()
