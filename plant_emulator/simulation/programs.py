"""The drive programs of the bench, as data.

Programs 1 to 4 are corner points of the motor's speed reference, linear between them. Program 4
adds three sweeps of rising frequency. The times of the corners are read off the logged references
of the independent bench. Programs 1 to 3 follow the thesis, Fig. 3.8.

Programs 6 and 6L are a forklift's travel cycle (thesis, Figs 4.7-4.10): 14 km/h, start at 2 s,
brake at 22 s. The truck has no load in program 6 and 1600 kg in program 6L.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import ParameterError
from plant_emulator.signals.log import Log

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

SAMPLE_PERIOD = 0.01


def sample_times(duration: float, period: float = SAMPLE_PERIOD) -> Array:
    """Times of the samples of a run [s], shape (n,), both ends included; duration, period [s]."""
    return np.arange(round(duration / period) + 1, dtype=np.float64) * period


@dataclass(frozen=True, kw_only=True)
class Sweep:
    """A sine of linearly rising frequency that is added to the speed reference.

    amplitude sin(2 pi (f_0 tau + (f_1 - f_0) tau^2 / 2L)), faded in and out linearly

    start, end, fade : times [s], L = end - start; amplitude [rad/s]; frequencies f_0, f_1 [Hz]
    """

    start: float
    end: float
    amplitude: float
    first_frequency: float
    last_frequency: float
    fade: float = 0.5

    def values(self, time: Array) -> Array:
        """Value of the sweep [rad/s] at times [s], 0 before and after it; shape (n,) each."""
        length = self.end - self.start
        tau = np.clip(time - self.start, 0.0, length)
        envelope = np.minimum(1.0, np.minimum(tau, length - tau) / self.fade)
        rise = (self.last_frequency - self.first_frequency) / (2.0 * length)
        phase = 2.0 * pi * (self.first_frequency * tau + rise * tau**2)
        return self.amplitude * envelope * np.sin(phase)


@dataclass(frozen=True, kw_only=True)
class SpeedProgram:
    """A speed reference of the motor: corner points (time [s], speed [rad/s]) and sweeps."""

    name: str
    duration: float
    corners: tuple[tuple[float, float], ...]
    sweeps: tuple[Sweep, ...] = ()

    def reference(self, period: float = SAMPLE_PERIOD) -> tuple[Array, Array]:
        """Sample times [s] and references [rad/s], shape (n,) each."""
        time = sample_times(self.duration, period)
        points, speeds = zip(*self.corners, strict=True)
        value: Array = np.interp(time, points, speeds)
        for sweep in self.sweeps:
            value = value + sweep.values(time)
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
    program.name: program
    for program in (
        SpeedProgram(
            name="program1",
            duration=18.5,
            corners=((0.5, 0.0), (5.5, 380.0), (14.0, 380.0), (17.3, 0.0)),
        ),
        SpeedProgram(
            name="program2",
            duration=25.0,
            corners=(
                (0.6, 0.0),
                (2.2, 120.0),
                (6.0, 120.0),
                (6.7, 170.0),
                (10.0, 170.0),
                (11.0, 240.0),
                (14.5, 240.0),
                (15.1, 275.0),
                (18.0, 275.0),
                (19.5, 375.0),
            ),
        ),
        SpeedProgram(
            name="program3",
            duration=50.0,
            corners=(
                (0.4, 0.0),
                (4.0, 225.0),
                (13.0, 225.0),
                (14.2, 140.0),
                (17.0, 140.0),
                (19.2, 0.0),
                (20.5, 0.0),
                (22.9, 150.0),
                (24.0, 150.0),
                (25.0, 90.0),
                (26.0, 90.0),
                (30.4, 365.0),
                (40.0, 365.0),
                (41.6, 260.0),
                (43.0, 260.0),
                (46.4, 0.0),
                (47.0, 0.0),
                (47.9, 45.0),
                (48.8, 45.0),
                (49.6, 0.0),
            ),
        ),
        SpeedProgram(
            name="program4",
            duration=60.0,
            corners=(
                (0.8, 0.0),
                (2.8, 100.0),
                (17.0, 100.0),
                (18.5, 190.0),
                (32.0, 190.0),
                (34.0, 300.0),
                (46.0, 300.0),
                (46.08, 350.0),
                (47.6, 350.0),
                (47.68, 300.0),
                (49.5, 300.0),
                (54.5, 70.0),
                (56.5, 70.0),
                (57.3, 0.0),
            ),
            sweeps=(
                Sweep(start=4.0, end=16.5, amplitude=25.0, first_frequency=0.1, last_frequency=0.9),
                Sweep(
                    start=19.5, end=31.5, amplitude=30.0, first_frequency=0.1, last_frequency=0.8
                ),
                Sweep(
                    start=35.0, end=45.5, amplitude=25.0, first_frequency=0.12, last_frequency=0.8
                ),
            ),
        ),
        TravelProgram(name="program6", duration=30.0, mass=3640.0),
        TravelProgram(name="program6L", duration=30.0, mass=5240.0),
    )
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
