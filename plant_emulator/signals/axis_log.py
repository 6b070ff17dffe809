"""A log of a single motor-driven axis: time, motion, force, and what else was measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array


@dataclass(frozen=True, kw_only=True)
class AxisLog:
    """The samples of an axis, shape (n,) each: linear [s, m, N] or rotary [s, rad, N m].

    position : as measured; where only the velocity was, the velocity's integral from 0
    velocity : [m/s or rad/s] of a log without a measured position; None: the position was measured
    load : external force that acts against the drive's [N or N m]; None: not measured
    temperature : of the axis [degC]; None: not measured
    source : name of the log in messages and answers
    other : columns of its file that were not used
    confirmed : quantities whose unit the user, or the format of the file, named
    """

    time: Array
    position: Array
    force: Array
    rotary: bool
    source: str
    velocity: Array | None = None
    load: Array | None = None
    temperature: Array | None = None
    other: tuple[str, ...] = ()
    confirmed: frozenset[str] = frozenset()
