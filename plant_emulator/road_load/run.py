"""What a pair of road logs is compared on: one window, one filter, one grid, its noise (pure).

The truck is simulated at the torque's own rate; the simulated velocity then passes the low pass
that the measured one passed, and is read off at the measured samples through the two clocks.

Two kinds of noise make the residual. The speed sensor's is white. The load cell's passes through
the truck, which integrates it into a random walk that ends whenever the truck stands. A Kalman
filter of that walk whitens the residual, so that least squares weighs every sample by what is new
in it; the filter is fixed beforehand, so that it stays least squares.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.road_load import truck_model
from plant_emulator.road_load.clock_offset import LEAST_OVERLAP, clock_ahead
from plant_emulator.road_load.signal import low_pass, noise, resting, trimmed

if TYPE_CHECKING:
    from plant_emulator.road_load.signal import Mask, Signal
    from plant_emulator.road_load.truck_model import RoadParameters, Truck
    from plant_emulator.signals.log import Array

RATE = 100.0
"""Samples a second that are compared, where both loggers are faster."""
EDGE = 0.2
"""[s] left out at both ends, where the low pass knows one side only."""
CREEP = 0.05
"""[m/s] below which nothing is compared but standstill: the moment at which a truck stops wipes out
what the load cell's noise had added up to, and would weigh as if it were knowledge."""
QUIETEST = (0.02, 0.001)
"""[N m] and [m/s] of noise below which the model itself, not the sensor, is the limit."""
UNSURE = (0.3, 0.5)
"""[s] after a stop and before a start in which the motor's torque may already or still be there."""
LEAST_REST = 0.3
"""[s] of sure standstill without which it is not used."""
BRIDGED = 0.05
"""[s] of lost torque over which a line may stand: its impulse moves the truck."""


@dataclass(frozen=True, kw_only=True)
class RoadRun:
    """A truck's two logs, prepared.

    torque_time [s], torque [N m], torque_held (where the truck is known to stand), shape (n,), at
    even `period` [s]; time [s] by the velocity's clock, measured [m/s], known, stands, shape (m,)
    ahead : first estimate of the clocks' distance [s]; cutoff : of the low pass [Hz]
    torque_noise [N m], velocity_noise [m/s] : standard deviations of a sample, on the grid
    """

    truck: Truck
    torque: Signal
    velocity: Signal
    first: int
    held: Mask
    time: Array
    measured: Array
    known: Mask
    rests: Mask
    moves: Mask
    ahead: float
    cutoff: float

    @property
    def moving_start(self) -> bool:
        """Whether the common part of the logs begins on the move."""
        return not bool(self.rests[0])

    @cached_property
    def spacing(self) -> float:
        """Time between two compared samples [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def masks(self) -> tuple[Mask, Mask, Mask]:
        """known, rests, moves."""
        return self.known, self.rests, self.moves

    @cached_property
    def torque_noise(self) -> float:
        """Standard deviation of one sample of the torque [N m]."""
        return max(noise(self.torque.values), QUIETEST[0])

    @cached_property
    def velocity_noise(self) -> float:
        """Standard deviation of one compared sample of the velocity [m/s].

        What white noise has below the low pass: as that of a mean over the samples left out.
        """
        shrink = self.velocity.period / self.spacing
        return max(noise(self.velocity.values), QUIETEST[1]) * float(np.sqrt(shrink))

    def simulated(self, parameters: RoadParameters) -> Array:
        """Velocity at the torque's samples from `first` on [m/s], low-passed."""
        torque = self.torque.values[self.first :]
        period = self.torque.period
        found = truck_model.velocity(
            parameters, self.truck, torque, self.held[self.first :], period
        )
        return low_pass(found, period, self.cutoff)

    def compared(self, parameters: RoadParameters, time: Array) -> Array:
        """Simulated velocity at those times of the velocity's clock [m/s]."""
        late = parameters.clock_skew * (time - self.velocity.start) + parameters.clock_ahead
        torque_time = self.torque.time[self.first :]
        return np.interp(time + late, torque_time, self.simulated(parameters))

    def residual(self, parameters: RoadParameters) -> Array:
        """Measured minus simulated velocity on the grid [m/s], shape (m,)."""
        return self.measured - self.compared(parameters, self.time)


def prepared(torque: Signal, velocity: Signal, truck: Truck) -> RoadRun:
    """The two logs, brought together; LogError names what stands in the way."""
    _check_gaps(torque)
    ahead = clock_ahead(torque, velocity)
    step = max(1, round(1.0 / (velocity.period * RATE)))
    period = step * velocity.period
    cutoff = 0.4 / max(period, torque.period)
    smooth = low_pass(velocity.values, velocity.period, cutoff)
    begin = max(torque.start, velocity.start + ahead)
    first = int(np.ceil((begin - torque.start) / torque.period - 1e-6))
    end = min(torque.end, velocity.end + ahead) - EDGE
    inside = (velocity.time + ahead >= begin + EDGE) & (velocity.time + ahead <= end)
    chosen = np.flatnonzero(inside)[::step]
    rests = resting(velocity.values, velocity.period)
    samples = [round(part / velocity.period) for part in (*UNSURE, LEAST_REST)]
    stands = trimmed(rests, *samples)
    moves = np.abs(smooth) > CREEP
    known = _sure(velocity, 0.5 / cutoff) & (moves | stands)
    _check_amount(known[chosen], period, torque, velocity)
    nearest = np.round((torque.time - ahead - velocity.start) / velocity.period).astype(np.int64)
    held = stands[np.clip(nearest, 0, len(stands) - 1)]
    return RoadRun(
        truck=truck,
        torque=torque,
        velocity=velocity,
        first=first,
        held=held,
        time=velocity.time[chosen],
        measured=smooth[chosen],
        known=known[chosen],
        rests=rests[chosen],
        moves=moves[chosen],
        ahead=ahead,
        cutoff=cutoff,
    )


def _sure(velocity: Signal, reach: float) -> Mask:
    """Samples further than `reach` [s] from any gap, shape (n,)."""
    width = 2 * round(reach / velocity.period) + 1
    missing = np.convolve(~velocity.known, np.ones(width), mode="same")
    return missing < 0.5


def _check_amount(known: Mask, period: float, torque: Signal, velocity: Signal) -> None:
    length = period * int(np.count_nonzero(known))
    if length < LEAST_OVERLAP:
        raise LogError(
            f"{torque.source}, {velocity.source}: only {length:.3g} s can be compared; at least "
            f"{LEAST_OVERLAP:g} s of the same travel are needed in both"
        )


def _check_gaps(torque: Signal) -> None:
    for start, length in torque.gaps():
        if length > BRIDGED:
            raise LogError(
                f"{torque.source}: no torque (missing, held or saturated) for {length:.3g} s from "
                f"{start:.4g} s on; the speed after it is unknown, at most {BRIDGED:g} s can be "
                "bridged: use the part before or after it"
            )
