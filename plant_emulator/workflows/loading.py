"""Which logs are taken together: read, without their own answer, each run once, of one bench."""

from __future__ import annotations

import re
from itertools import combinations
from typing import TYPE_CHECKING, cast

import numpy as np

from plant_emulator import logs
from plant_emulator.errors import DiagnosisError
from plant_emulator.recordings.preflight import NAMES, preflight
from plant_emulator.recordings.recording import recording
from plant_emulator.recordings.same_bench import one_bench
from plant_emulator.signals.log import VOLTAGE, Log

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.axis_log import AxisLog
    from plant_emulator.signals.log import Array
    from plant_emulator.simulation.simulate import Hold

    Used = Mapping[str, NDArray[np.bool_]]

# Columns that tell the answer, by how a word of their name begins: nobody may see them before.
TELLING = re.compile(
    "label|effect(?!ive)|fault|class|answer|anomal|scenario|cause|truth|drift|verdict|diagnos"
)
# Words of a name: parted by what is no letter, or by a capital.
WORD = re.compile("[A-Z]?[a-z]+|[A-Z]+")
# What formats may round off a sample [SI].
ROUNDED = 1e-4
# Signals that every log of the bench has.
NEEDED = ("speed_reference", "motor_speed", "drum_speed", "shaft_torque")


def admitted(
    sources: Sequence[str | Path | Log], parameters: ParameterSet, hold: str | None
) -> tuple[list[Recording], list[str]]:
    """The logs of one bench ready to be fitted, and what the user should know of them.

    sources : logs, or the paths of their files

    DiagnosisError or LogError says what cannot be used.
    """
    taken: list[Log] = []
    uses: list[Used] = []
    notes: list[str] = []
    for source in sources:
        log = source if isinstance(source, Log) else logs.read(source)
        unlabelled(log)
        checked = preflight(log, parameters.value("gear_ratio"))
        taken.append(log)
        uses.append(checked.use)
        notes += checked.notes
    uses, told = alike(taken, uses)
    distinct([(log.source, samples(log)) for log in taken])
    one_bench(taken, parameters.values())
    recordings = [
        recording(log, cast("Hold | None", hold), use) for log, use in zip(taken, uses, strict=True)
    ]
    return recordings, notes + told


def alike(read: Sequence[Log], uses: Sequence[Used]) -> tuple[list[Used], list[str]]:
    """The samples of every log that count, all with their voltage or none: what it shows could else
    be neither fitted where it is not, nor predicted from there. And a note where one is left out.
    """
    having = [VOLTAGE in use for use in uses]
    if all(having) or not any(having):
        return list(uses), []
    first = read[having.index(False)].source
    note = f"{first}: no {NAMES[VOLTAGE]} that can be used; it is left out of the other logs too"
    return [{n: counted for n, counted in use.items() if n != VOLTAGE} for use in uses], [note]


def unlabelled(log: Log | AxisLog) -> None:
    """Refuse a log that carries its own answer."""
    where = "variable" if log.source.endswith(".mat") else "line 1: column"
    for name in log.other:
        if any(TELLING.match(word.lower()) for word in WORD.findall(name)):
            raise DiagnosisError(
                f"{log.source}: {where} {name} looks like the answer; a diagnosis must "
                "not see it: take it out"
            )


def samples(log: Log) -> Array:
    """What makes a log of the bench the run that it is, shape (signals, samples)."""
    return np.stack([log.time - log.time[0], *(log[name] for name in NEEDED)])


def distinct(runs: Sequence[tuple[str, Array]]) -> None:
    """Refuse the same run twice: its samples tell, whatever file holds them.

    runs : what errors call it, and its samples
    """
    for (name, first), (other, second) in combinations(runs, 2):
        if first.shape == second.shape and np.allclose(first, second, rtol=0.0, atol=ROUNDED):
            raise DiagnosisError(f"{other}: the same run as {name}; give every run once")
