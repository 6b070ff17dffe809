"""A log of a single motor-driven axis: time, position and force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class AxisLog:
    """The samples of an axis, shape (n,) each: linear [s, m, N] or rotary [s, rad, N m].

    source : name of the log in messages and answers
    other : columns of its file that were not used
    """

    time: Array
    position: Array
    force: Array
    rotary: bool
    source: str
    other: tuple[str, ...] = ()
