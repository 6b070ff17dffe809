"""A file as a table of named columns, whatever its format, before its physics is known."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from plant_emulator.signals.log import Array
    from plant_emulator.workflows.axis_files.columns import Choice


@dataclass(frozen=True, kw_only=True)
class Table:
    """The columns of a file.

    path : of the file; header : place of the names, for messages
    units : of the columns that the file gives a unit, by name
    take : values of the columns of these names, shape (n,) each; raises LogError with the place
    row : place of a sample in words, by its index
    known : choice of columns of a file whose machine is known
    others : what the file holds beside columns, by name
    """

    path: str
    header: str
    names: tuple[str, ...]
    take: Callable[[Sequence[str]], list[Array]]
    row: Callable[[int], str]
    units: Mapping[str, str] = field(default_factory=dict)
    known: tuple[Choice, ...] = ()
    others: tuple[str, ...] = ()

    def check_finite(self, name: str, values: Array) -> None:
        """Raise LogError for a column whose value is not finite."""
        if not np.isfinite(values).all():
            row = int(np.argmin(np.isfinite(values)))
            raise LogError(
                f"{self.path}: {self.row(row)}, column {name}: {values[row]}; "
                "a finite number is needed"
            )

    def check_increasing(self, name: str, times: Array) -> None:
        """Raise LogError for a column of times [s] that does not increase strictly."""
        if len(times) < 2:
            raise LogError(f"{self.path}: {len(times)} samples; at least 2 are needed")
        if not (later := np.diff(times) > 0.0).all():
            row = int(np.argmin(later)) + 1
            raise LogError(
                f"{self.path}: {self.row(row)}, column {name}: {times[row]:g} after "
                f"{times[row - 1]:g}; time must increase strictly"
            )
