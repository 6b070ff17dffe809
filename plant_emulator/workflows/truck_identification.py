"""Identifies a truck's road load and gear efficiency from the files of its two road logs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from plant_emulator.model.dimensions import DRUM_RADIUS, TRUCK_RATIO, WHEEL_RADIUS
from plant_emulator.road_load import coast_down
from plant_emulator.road_load.answer import answer_of
from plant_emulator.road_load.fit import fit
from plant_emulator.road_load.run import prepare
from plant_emulator.road_load.signal import signal
from plant_emulator.road_load.truck_model import Truck
from plant_emulator.road_load.truck_table import table
from plant_emulator.workflows import road_log

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from plant_emulator.road_load.answer import RoadAnswer, TruckEstimate
    from plant_emulator.road_load.coast_down import CoastDown
    from plant_emulator.road_load.fit import RoadFit


@dataclass(frozen=True, kw_only=True, repr=False)
class TruckIdentification:
    """An identified truck; `print` shows the table of the command `identify-truck`.

    origin : lines about date, version and logs, for the saved table
    """

    answer: RoadAnswer
    fit: RoadFit
    origin: tuple[str, ...]

    @property
    def estimates(self) -> Mapping[str, TruckEstimate]:
        """Estimates by their names in the answer file, with standard errors."""
        return self.answer.estimates

    @property
    def problems(self) -> tuple[str, ...]:
        """Reasons against a use of the estimates; empty if there are none."""
        return self.answer.problems

    @property
    def converged(self) -> bool:
        """Whether the estimates may be used."""
        return self.answer.converged

    def to_json(self) -> dict[str, Any]:
        """The answer as JSON types, schema truck/1."""
        return self.answer.to_json()

    def truck_table(self) -> str:
        """Text of a TOML file with the `[truck]` table of the gateway's configuration."""
        return table(self.answer, self.fit.run.truck, self.origin)

    def plot(self, path: str | Path) -> None:
        """Plot velocity, residual and torque to a file: PNG, SVG or PDF by its suffix.

        Raises InputError where the file cannot be written, ValueError for another suffix.
        """
        from plant_emulator.workflows.road_load_plot import plot

        plot(self.fit, path)

    def __str__(self) -> str:
        return str(self.answer)

    def __repr__(self) -> str:
        shown = [f"{name} {self.estimates[name]}" for name in ("crr", "efficiency")]
        state = "" if self.converged else "; not converged"
        return f"<TruckIdentification: {', '.join(shown)}{state}>"


def identify_truck(
    torque_log: str | Path,
    velocity_log: str | Path,
    *,
    mass: float,
    ratio: float = TRUCK_RATIO,
    wheel_radius: float = WHEEL_RADIUS,
    drum_radius: float = DRUM_RADIUS,
    gain_uncertainty: float = 0.02,
) -> TruckIdentification:
    """Identify a truck's road load and gear efficiency from two logs of a level road.

    torque_log : CSV file with `time_s` and `motor_torque_Nm`, plain or gzip-compressed
    velocity_log : CSV file with `time_s` and `velocity_m_s`; its logger has its own clock and rate
    mass : of the truck with its load [kg]; ratio : motor speed over wheel speed [1]
    wheel_radius : [m]; drum_radius : of the bench, to whose speed crr_v refers [m]
    gain_uncertainty : standard deviation of the load cell's gain from 1, from its calibration [1]

    Raises LogError if a log cannot be read or the logs do not belong together. Check `converged`
    before a use of the estimates.
    """
    files = str(torque_log), str(velocity_log)
    truck = Truck(mass=mass, ratio=ratio, wheel_radius=wheel_radius, drum_radius=drum_radius)
    torque = signal(*road_log.read(files[0], road_log.TORQUE), files[0])
    velocity = signal(*road_log.read(files[1], road_log.VELOCITY), files[1], rest=0.0)
    found = fit(prepare(torque, velocity, truck), gain_uncertainty)
    return TruckIdentification(
        answer=answer_of(found), fit=found, origin=tuple(road_log.origin(*files))
    )


def identify_coast_down(
    velocity_logs: Sequence[str | Path], *, mass: float
) -> tuple[CoastDown, tuple[str, ...]]:
    """Identify a truck's road load from coast-downs; return it and lines about its origin.

    velocity_logs : CSV files with `time_s` and `velocity_m_s`, one roll-out each, negative in the
        other direction
    mass : of the truck with its load [kg]

    Raises LogError for a log that cannot be used, or where all runs go in one direction.
    """
    files = [str(one) for one in velocity_logs]
    runs = [coast_down.roll_out(file, *road_log.read(file, road_log.VELOCITY)) for file in files]
    return coast_down.fit(runs, mass), tuple(road_log.origin(*files))
