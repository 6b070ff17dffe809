"""A log of the bench: time, and one array for each signal, SI.

The columns of a log file carry a unit in their name (`register_maps.signals.LOG_COLUMNS`). Here the
name is that of the signal and the unit is SI. `logs` reads and writes files.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Mapping

Array = NDArray[np.float64]


# Channels on which a simulation is compared with a log, and a further one that a log may have.
COMPARED = ("motor_speed", "drum_speed", "armature_current", "shaft_torque")
VOLTAGE = "armature_voltage"
# Torque of a truck on the drum, and the mark of a truck whose torque nobody measured.
WHEEL_TORQUE, TRUCK = "wheel_torque", "truck_on_drum"
# Knees of the speed reference after each sample: seconds after it (0: none), and value.
KNEE_TIME, KNEE = "reference_knee_time", "reference_knee"
KNEES = (
    (KNEE_TIME, KNEE),
    ("reference_knee_2_time", "reference_knee_2"),
    ("reference_knee_3_time", "reference_knee_3"),
)
# Signals that act on the bench, and the standard deviation of what is not known of them in a hole
# of the log [SI]: the same at all of its rows, and 0 elsewhere.
INPUT_ERRORS = {"speed_reference": "speed_reference_error", WHEEL_TORQUE: "wheel_torque_error"}
# Standard deviation of what is not known of the time that a row was taken at [s].
TIMING_ERROR = "timing_error"
# A channel that moves by less than this share of its largest value shows rounding only [1].
CONSTANT_WITHIN = 1e-9


@dataclass(frozen=True)
class Log:
    """The samples of a run: time [s] and signals by name [SI], shape (n,) each.

    source : name of the log in messages and answers
    other : columns of its file that are not signals
    """

    time: Array
    signals: Mapping[str, Array]
    source: str = "log"
    other: tuple[str, ...] = field(default=())

    def __getitem__(self, signal: str) -> Array:
        """The samples of a signal [SI], shape (n,); KeyError names the signals of the log."""
        if signal not in self.signals:
            known = ", ".join(self.signals)
            raise KeyError(f"{self.source}: no signal {signal!r}; known: {known}")
        return self.signals[signal]

    def __contains__(self, signal: str) -> bool:
        return signal in self.signals

    def __repr__(self) -> str:
        seconds = self.time[-1] - self.time[0] if len(self.time) else 0.0
        names = ", ".join(self.signals)
        return f"<Log {self.source}: {len(self.time)} samples, {seconds:g} s; {names}>"


def compared_channels(log: Log) -> tuple[str, ...]:
    """Names of the channels on which a simulation is compared with this log.

    The voltage is one of them only if it moves: an unconnected channel is constant.
    """
    given = tuple(name for name in COMPARED if name in log)
    if VOLTAGE not in log:
        return given
    moves = np.ptp(log[VOLTAGE]) > CONSTANT_WITHIN * np.max(np.abs(log[VOLTAGE]))
    return (*given, VOLTAGE) if moves else given


def has_truck(log: Log) -> bool:
    """Whether a truck stood on the drum, its wheel torque measured or not."""
    return WHEEL_TORQUE in log or (TRUCK in log and bool(np.any(log[TRUCK] > 0.5)))


def without_voltage(log: Log) -> Log:
    """The log without its voltage."""
    signals = {name: values for name, values in log.signals.items() if name != VOLTAGE}
    return replace(log, signals=signals)
