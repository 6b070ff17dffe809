"""Types of what the kernel's functions share.

A Record is read and written by attribute, all floats; which attributes it has is data
(`stage.STAGE`, the parameter names), laid out when the kernel is built: a NumPy structured scalar
for the compiled kernel, a plain namespace for the uncompiled one. A State is a vector or table of
floats: a NumPy array, or (nested) lists.
"""

from __future__ import annotations

from typing import Any, Protocol


class Record(Protocol):
    """A set of named floats."""

    def __getattr__(self, name: str) -> float:
        """Value of one name."""

    def __setattr__(self, name: str, value: float) -> None:
        """Set the value of one name."""


State = Any
