"""A log of the bench: time and one column a signal, SI.

The columns of a file carry their unit in their name (`register_maps.signals.LOG_COLUMNS`); inside
the unit is SI and the name is the signal's. Nothing here reads a file: `logs` has one module a
format.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Mapping

Array = NDArray[np.float64]


# Channels that a simulation is compared on, and one more where a log has it.
COMPARED = ("motor_speed", "drum_speed", "armature_current", "shaft_torque")
VOLTAGE = "armature_voltage"
# Share of a channel's largest value below which it does not move, but is rounded.
STILL = 1e-9


@dataclass(frozen=True)
class Log:
    """Samples of a run: time [s], shape (n,), and signals [SI], shape (n,) each.

    source : what errors and answers call it; other : columns of the file that are no signals
    """

    time: Array
    signals: Mapping[str, Array]
    source: str = "log"
    other: tuple[str, ...] = field(default=())

    def __getitem__(self, signal: str) -> Array:
        return self.signals[signal]

    def __contains__(self, signal: str) -> bool:
        return signal in self.signals

    def __repr__(self) -> str:
        seconds = self.time[-1] - self.time[0] if len(self.time) else 0.0
        names = ", ".join(self.signals)
        return f"<Log {self.source}: {len(self.time)} samples, {seconds:g} s; {names}>"


def compared_channels(log: Log) -> tuple[str, ...]:
    """Channels of a log that a simulation is compared on.

    The voltage only where it moves: a column of it that nobody feeds stays where it is.
    """
    given = tuple(name for name in COMPARED if name in log)
    if VOLTAGE not in log:
        return given
    moves = np.ptp(log[VOLTAGE]) > STILL * np.max(np.abs(log[VOLTAGE]))
    return (*given, VOLTAGE) if moves else given


def without_voltage(log: Log) -> Log:
    """The log as it would be if nobody had connected the voltage."""
    signals = {name: values for name, values in log.signals.items() if name != VOLTAGE}
    return replace(log, signals=signals)
