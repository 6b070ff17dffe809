"""Types of the arguments that the functions of the kernel share.

A Record holds named floats that are read and written by attribute. Its names are data:
`stage.STAGE`, or the names of the parameters. A kernel lays its records out when it is built: as
NumPy structured scalars if it is compiled, else as plain namespaces. A State is a vector or a table
of floats: a NumPy array, or nested lists.
"""

from __future__ import annotations

from typing import Any, Protocol


class Record(Protocol):
    """A record of named floats."""

    def __getattr__(self, name: str) -> float:
        """Value of one field."""

    def __setattr__(self, name: str, value: float) -> None:
        """Set the value of one field."""


State = Any
