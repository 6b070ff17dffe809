"""A log of the bench: time and one column a signal, SI.

The columns of a file carry their unit in their name (contracts, section 1); inside the unit is SI
and the name is the signal's. Nothing here reads a file: `logs` has one module a format.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from plant_emulator.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Mapping

Array = NDArray[np.float64]
ZERO_CELSIUS = 273.15


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column of a log file: SI value = value in the file + offset."""

    signal: str
    name: str
    needed: bool
    decimals: int
    offset: float = 0.0


COLUMNS = (
    Column(signal="time", name="time_s", needed=True, decimals=4),
    Column(signal="speed_reference", name="speed_reference_rad_s", needed=True, decimals=5),
    Column(signal="motor_speed", name="motor_speed_rad_s", needed=True, decimals=5),
    Column(signal="drum_speed", name="drum_speed_rad_s", needed=True, decimals=6),
    Column(signal="armature_current", name="armature_current_A", needed=False, decimals=5),
    Column(signal="shaft_torque", name="shaft_torque_Nm", needed=True, decimals=5),
    Column(signal="wheel_torque", name="wheel_torque_Nm", needed=False, decimals=4),
    Column(signal="armature_voltage", name="armature_voltage_V", needed=False, decimals=4),
    Column(
        signal="shell_temperature",
        name="shell_temperature_degC",
        needed=False,
        decimals=2,
        offset=ZERO_CELSIUS,
    ),
)
# Channels that a simulation is compared on.
COMPARED = ("motor_speed", "drum_speed", "armature_current", "shaft_torque")


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


def checked(log: Log) -> Log:
    """The log, if it is usable: at least two samples, time strictly increasing, values finite."""
    if len(log.time) < 2:
        raise LogError(f"{log.source}: {len(log.time)} samples; at least 2 are needed")
    for column in COLUMNS:
        if column.needed and column.signal != "time" and column.signal not in log:
            raise LogError(f"{log.source}: column {column.name} is missing; it is needed")
    return log
