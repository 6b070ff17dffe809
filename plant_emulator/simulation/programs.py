"""The drive programs of the bench: programs 1 to 4 of `register_maps`, and the travel programs.

Programs 6 and 6L are a forklift's travel cycle (thesis, Figs 4.7-4.10): 14 km/h, start at 2 s,
brake at 22 s. The truck has no load in program 6 and 1600 kg in program 6L.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import ParameterError
from plant_emulator.signals.log import Log
from register_maps.logs.drive_programs import DRIVE_PROGRAMS, DriveProgram

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

SAMPLE_PERIOD = 0.01


def sample_times(duration: float, period: float = SAMPLE_PERIOD) -> Array:
    """Times of the samples of a run [s], shape (n,), both ends included; duration, period [s]."""
    return np.arange(round(duration / period) + 1, dtype=np.float64) * period


@dataclass(frozen=True, kw_only=True)
class SpeedProgram(DriveProgram):
    """A drive program that can be sampled.

    name, duration [s] : of the program
    corners : time [s] and speed reference [rad/s] where the linear pieces meet
    sweeps : sines of rising frequency on top
    """

    def reference(self, period: float = SAMPLE_PERIOD) -> tuple[Array, Array]:
        """Sample times [s] and references [rad/s], shape (n,) each."""
        time = sample_times(self.duration, period)
        points, speeds = zip(*self.corners, strict=True)
        value: Array = np.interp(time, points, speeds)
        for sweep in self.sweeps:
            value = value + np.array([sweep.value(moment) for moment in time])
        return time, value

    def inputs(self) -> Log:
        """A log of the speed reference alone."""
        time, reference = self.reference()
        return Log(time, {"speed_reference": reference}, self.name)


@dataclass(frozen=True, kw_only=True)
class TravelProgram:
    """A forklift's travel cycle on the drum; mass : of the truck with its load [kg]."""

    name: str
    duration: float
    mass: float


Program = SpeedProgram | TravelProgram

PROGRAMS: dict[str, Program] = {
    **{name: SpeedProgram(**vars(one)) for name, one in DRIVE_PROGRAMS.items()},
    "program6": TravelProgram(name="program6", duration=30.0, mass=3640.0),
    "program6L": TravelProgram(name="program6L", duration=30.0, mass=5240.0),
}


def describe(program: Program) -> str:
    """Describe a program in words: name, length, and its largest speed or its truck."""
    if isinstance(program, TravelProgram):
        return f"{program.name} (a truck of {program.mass:.0f} kg on the drum)"
    fastest = max(speed for _, speed in program.corners)
    sweeps = ", with sweeps" if program.sweeps else ""
    return f"{program.name} ({program.duration:g} s, to {fastest:.0f} rad/s{sweeps})"


def program(name: str) -> Program:
    """The drive program of that name; ParameterError where there is none."""
    if name not in PROGRAMS:
        raise ParameterError(f"{name}: no such program; known: {', '.join(PROGRAMS)}")
    return PROGRAMS[name]
