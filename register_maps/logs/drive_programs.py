"""Drive programs 1 to 4 of the bench, as data: corner points of the motor's speed reference.

The reference is linear between its corners. Program 4 adds three sine sweeps of rising frequency.
The times of the corners are read off the logged references of the independent bench. Programs 1 to
3 follow the thesis, Fig. 3.8. The emulator simulates these programs, and the gateway drives them.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, sin


def interpolate(times: Sequence[float], values: Sequence[float], time: float) -> float:
    """Value at a time, linear between the times, constant before the first and after the last.

    times : ascending, shape (n,); values : in any unit, which is that of the result, shape (n,)
    """
    after = bisect_right(times, time)
    if after in (0, len(times)):
        return values[max(after - 1, 0)]
    since, to = times[after - 1], times[after]
    before = values[after - 1]
    return before + (values[after] - before) * (time - since) / (to - since)


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

    def value(self, time: float) -> float:
        """Value of the sweep [rad/s] at a time [s]; 0 before and after it."""
        length = self.end - self.start
        tau = min(max(time - self.start, 0.0), length)
        envelope = min(1.0, min(tau, length - tau) / self.fade)
        rise = (self.last_frequency - self.first_frequency) / (2.0 * length)
        phase = 2.0 * pi * (self.first_frequency * tau + rise * tau**2)
        return self.amplitude * envelope * sin(phase)


@dataclass(frozen=True, kw_only=True)
class DriveProgram:
    """A speed reference of the motor: corner points (time [s], speed [rad/s]) and sweeps."""

    name: str
    duration: float
    corners: tuple[tuple[float, float], ...]
    sweeps: tuple[Sweep, ...] = ()

    def points(self, period: float) -> tuple[tuple[float, float], ...]:
        """Points (time [s], speed [rad/s]) between which the reference is linear.

        period : from point to point inside a sweep [s]
        """
        inside = {
            sweep.start + number * period
            for sweep in self.sweeps
            for number in range(round((sweep.end - sweep.start) / period) + 1)
        }
        times = sorted({0.0, self.duration, *(time for time, _ in self.corners), *inside})
        return tuple((time, self._speed(time)) for time in times)

    def _speed(self, time: float) -> float:
        times, speeds = zip(*self.corners, strict=True)
        swept = sum(sweep.value(time) for sweep in self.sweeps)
        return interpolate(times, speeds, time) + swept


DRIVE_PROGRAMS: dict[str, DriveProgram] = {
    program.name: program
    for program in (
        DriveProgram(
            name="program1",
            duration=18.5,
            corners=((0.5, 0.0), (5.5, 380.0), (14.0, 380.0), (17.3, 0.0)),
        ),
        DriveProgram(
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
        DriveProgram(
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
        DriveProgram(
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
    )
}
