"""Loading of the logs of a bench, for every analysis in one way: read, check, weigh by the noise.

A log is refused that carries its own answer, that the preflight refuses, that shows the same run as
another one, or that is of another bench.
"""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING, cast

import numpy as np

from plant_emulator import logs
from plant_emulator.errors import LogError
from plant_emulator.recordings.holes import bridge_holes
from plant_emulator.recordings.preflight import NAMES, preflight
from plant_emulator.recordings.recording import recording
from plant_emulator.recordings.same_bench import check_same_bench
from plant_emulator.recordings.shared_noise import with_shared_noise
from plant_emulator.recordings.stamps import restamp_all
from plant_emulator.recordings.wheel_torque import mark_informative, with_estimated_torque
from plant_emulator.signals.log import KNEE_TIME, VOLTAGE, Log
from plant_emulator.simulation.simulate import values_of
from plant_emulator.workflows.arguments import check_signals

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.axis_log import AxisLog
    from plant_emulator.signals.log import Array
    from plant_emulator.simulation.run_inputs import Hold

    # A log, or the path of its file.
    Source = str | Path | Log

# Columns that tell the answer, by how a word of their name begins.
TELLING = re.compile(
    "label|effect(?!ive)|fault|class|answer|anomal|scenario|cause|truth|drift|verdict|diagnos"
)
# Words of a name: separated by what is no letter, or by a capital.
WORD = re.compile("[A-Z]?[a-z]+|[A-Z]+")
# What a user should know of a truck without a logged torque.
UNKNOWN_TORQUE = (
    "a truck stands on the drum whose wheel torque nobody measured; it is estimated from the "
    "gear's relation, what its error could explain is left open, and flights through the gap do "
    "not count"
)
# Rounding of a sample by a file format, at most [SI].
ROUNDED = 1e-4
# Signals that every log of the bench has.
NEEDED = ("speed_reference", "motor_speed", "drum_speed", "shaft_torque")


def load_recordings(
    sources: Sequence[Source],
    parameters: ParameterSet,
    reference: str | None = None,
    *,
    common_channels: bool = False,
    fitted: int | None = None,
) -> tuple[list[Recording], list[str]]:
    """Load the logs of one bench; return the recordings, and notes on what the user should know.

    sources : logs, or the paths of their files
    reference : what holds between samples of the speed reference; None: as the log says
    common_channels : leave a voltage out that only some logs have. A pooled fit uses the voltages
        that there are. A held-out run can be predicted only in channels that the fitted runs have.
    fitted : so many of the sources, the first ones, tell the noise of all; None: all of them do
    Raises LogError for a log that cannot be used.
    """
    taken: list[Log] = []
    uses: list[Mapping[str, NDArray[np.bool_]]] = []
    notes: list[str] = []
    read = [source if isinstance(source, Log) else logs.read(source) for source in sources]
    for log in read:
        check_unlabelled(log)
        check_signals(log, NEEDED)
    checks = [preflight(log, parameters.value("gear_ratio")) for log in read]
    for (stamped, jitter), checked in zip(restamp_all(read, fitted), checks, strict=True):
        if jitter > 0.0:
            notes.append(
                f"{stamped.source}: rows were taken {1e3 * jitter:.1f} ms (rms) off their stamps; "
                "what the references of the logs tell of that is corrected"
            )
        log, use = bridge_holes(stamped, checked.use)
        known = with_estimated_torque(log, parameters.values())
        if known is not log:
            told = mark_informative(known, parameters.values())
            use = {name: counted & told for name, counted in use.items()}
            left = 100.0 * (1.0 - np.mean(told))
            notes.append(f"{log.source}: {UNKNOWN_TORQUE}; {left:.0f} % of the run is left out")
        taken.append(known)
        uses.append(use)
        notes += checked.notes
    check_distinct([(log.source, samples(log)) for log in taken])
    check_same_bench(taken, parameters.values())
    hold = cast("Hold | None", reference)
    weighed = [
        _weighed(recording(log, hold, use, parameters.sensors), parameters)
        for log, use in zip(taken, uses, strict=True)
    ]
    recordings = with_shared_noise(weighed, fitted)
    if common_channels:
        recordings, more = with_common_voltage(recordings)
        notes += more
    return recordings, notes


def _weighed(loaded: Recording, parameters: ParameterSet) -> Recording:
    """The recording of a gateway, with the noise beside a simulation.

    A truck's torque, or commands that reach the PLC early or late, move the reference from sample
    to sample. A noise that the user declared stays.
    """
    if not loaded.estimated_torque and KNEE_TIME not in loaded.log:
        return loaded
    beside = loaded.with_noise_beside(values_of(parameters))
    declared = [bool(getattr(parameters.sensors.get(n), "noise", 0.0)) for n in loaded.channels]
    return replace(beside, noise=np.where(declared, loaded.noise, beside.noise))


def with_common_voltage(recordings: Sequence[Recording]) -> tuple[list[Recording], list[str]]:
    """The recordings, all with their voltage or all without it, and a note where one loses it."""
    lacking = [r for r in recordings if VOLTAGE not in r.channels]
    if not lacking or len(lacking) == len(recordings):
        return list(recordings), []
    note = (
        f"{lacking[0].log.source}: no {NAMES[VOLTAGE]} that can be used; it is left out of the "
        "other logs too"
    )
    return [r.without_voltage() for r in recordings], [note]


def check_unlabelled(log: Log | AxisLog) -> None:
    """Raise LogError for a log with a column that looks like the answer."""
    where = "variable" if log.source.endswith(".mat") else "line 1: column"
    for name in log.other:
        if any(TELLING.match(word.lower()) for word in WORD.findall(name)):
            raise LogError(
                f"{log.source}: {where} {name} looks like the answer; an analysis must not see "
                "it: take it out"
            )


def samples(log: Log) -> Array:
    """Samples by which a run of the bench is recognised, shape (signals, samples)."""
    return np.stack([log.time - log.time[0], *(log[name] for name in NEEDED)])


def check_distinct(runs: Sequence[tuple[str, Array]]) -> None:
    """Raise LogError if two logs show the same run, whatever files hold them.

    runs : name and samples of each
    """
    for (name, first), (other, second) in combinations(runs, 2):
        if first.shape == second.shape and np.allclose(first, second, rtol=0.0, atol=ROUNDED):
            raise LogError(f"{other}: the same run as {name}; give every run once")
