"""The next run: of a family of drive programs the one in which two drafted laws differ most.

A program of the family drives to a speed along a ramp, holds it, may add a sine sweep, and drives
back to standstill or through standstill into the other direction. It keeps within the speeds and
slopes of the runs that were driven. Both laws are simulated with their own fitted parameters.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import UnsettledError
from plant_emulator.identification.experiment_design import noise_levels
from plant_emulator.model.stage import split_gap_position
from plant_emulator.simulation.programs import SpeedProgram
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import simulate
from register_maps.logs.drive_programs import Sweep

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from plant_emulator.recordings.recording import Recording

# Speeds and slopes [largest of the runs], lengths of a cruise [s], amplitudes [speed].
CRUISE_SPEEDS, RAMP_SLOPES = (0.1, 0.3, 0.6, 1.0), (0.25, 1.0)
CRUISES = (2.0, 8.0)
AMPLITUDES = (0.0, 0.1)
# Standstill before and after [s]; duration that no program passes [s].
STANDSTILL_TIME, LONGEST_PROGRAM = 0.5, 60.0
# Frequencies of a sweep [Hz]. Its largest slope must keep within that of the runs.
FREQUENCIES = (0.2, 1.0)


@dataclass(frozen=True, kw_only=True)
class Separation:
    """A drive program, and the norm of the difference of two laws in it over the noise [1]."""

    program: SpeedProgram
    norm: float


def best_separation(
    recordings: Sequence[Recording], one: Mapping[str, float], other: Mapping[str, float]
) -> Separation | None:
    """The program that separates two laws best, per square root of its length.

    one, other : all values of a simulation with each law, with the states of its start
    None: no program can be simulated
    """
    levels = noise_levels(recordings)
    fastest = max(float(np.max(np.abs(r.log["speed_reference"]))) for r in recordings)
    steepest = max(
        float(np.quantile(np.abs(np.diff(r.log["speed_reference"]) / np.diff(r.log.time)), 0.99))
        for r in recordings
    )
    backwards = any(float(r.log["speed_reference"].min()) < -0.05 * fastest for r in recordings)
    found = []
    for trial in programs(fastest, steepest, backwards=backwards):
        with suppress(UnsettledError):
            found.append(Separation(program=trial, norm=_norm(trial, levels, one, other)))
    return max(found, key=lambda s: s.norm / np.sqrt(s.program.duration), default=None)


def programs(fastest: float, steepest: float, *, backwards: bool) -> Iterator[SpeedProgram]:
    """The family; fastest [rad/s] and steepest [rad/s^2] : limits of the reference.

    backwards : whether the reference may change its direction
    """
    ways = (1.0, -1.0) if backwards else (1.0,)
    choices = product(CRUISE_SPEEDS, RAMP_SLOPES, CRUISES, AMPLITUDES, ways)
    for share, part, cruise, amplitude, way in choices:
        speed = share * fastest
        ramp = speed / (part * steepest)
        size = min(amplitude * speed, 0.5 * steepest / (2.0 * np.pi * FREQUENCIES[1]))
        begin = STANDSTILL_TIME + ramp
        end = begin + cruise
        corners = [
            (STANDSTILL_TIME, 0.0),
            (begin, speed * (1.0 - amplitude)),
            (end, speed * (1 - amplitude)),
        ]
        corners.append((end + ramp, 0.0))
        if way < 0.0:
            back = end + 2.0 * ramp
            corners[-1:] = [(back, -speed), (back + cruise, -speed), (back + cruise + ramp, 0.0)]
        duration = corners[-1][0] + STANDSTILL_TIME
        if duration > LONGEST_PROGRAM:
            continue
        sweep = Sweep(
            start=begin,
            end=end,
            amplitude=float(size),
            first_frequency=FREQUENCIES[0],
            last_frequency=FREQUENCIES[1],
        )
        yield SpeedProgram(
            name="separation",
            duration=round(duration, 2),
            corners=tuple(corners),
            sweeps=(sweep,) if amplitude > 0.0 else (),
        )


def _norm(
    program: SpeedProgram,
    levels: Mapping[str, float],
    one: Mapping[str, float],
    other: Mapping[str, float],
) -> float:
    run = inputs_of(program.inputs())
    first, second = (
        simulate(run, values, gap_position=gap)
        for values, gap in map(split_gap_position, (one, other))
    )
    squares = [
        np.sum(((first[name] - second[name]) / level) ** 2) for name, level in levels.items()
    ]
    return float(np.sqrt(sum(squares)))
