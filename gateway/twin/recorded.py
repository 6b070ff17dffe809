"""The error budget of a recording: files in, answer out."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gateway import config_file
from gateway.errors import ConfigError
from gateway.recordings import recording
from gateway.recordings.header import config_of, map_of
from gateway.twin import closed_loop
from gateway.twin.budget import Budget, budget
from gateway.twin.closed_loop import Twin, TwinRun
from gateway.twin.wheel_torque import RecordedTorque, wheel_torque
from plant_emulator import parameter_sets
from plant_emulator.parameter_sets import with_effects
from register_maps.timing import SCAN


@dataclass(frozen=True, kw_only=True)
class RecordedBudget:
    """Error budget of a recorded run, and the parameter set of its digital twin.

    judged, duration : first part of the run that the budget judges, and the whole [s]. A road on
        which the truck is faster than the bench may be ends the first part.
    """

    recording: Path
    parameters: str
    budget: Budget
    judged: float
    duration: float

    def to_json(self) -> dict[str, Any]:
        """Return the budget as the document budget/1."""
        return {
            "schema": "budget/1",
            "recording": str(self.recording),
            "parameters": self.parameters,
            "judged_seconds": self.judged,
            "duration_seconds": self.duration,
            **self.budget.to_json(),
        }

    def __str__(self) -> str:
        if self.judged == self.duration:
            return str(self.budget)
        return (
            f"{self.budget}\njudged: the first {self.judged:.1f} of {self.duration:.1f} s; "
            "then the truck would be faster on the road than limits.speed_max_rpm lets the bench be"
        )


def budget_of(path: Path, parameters: str) -> RecordedBudget:
    """Error budget of a recording with the twin of a parameter set, a shipped name or a file.

    Raises ConfigError or GatewayError for a recording that holds no truck in road load.
    """
    bench = with_effects.load(parameters)
    found = recording.read(path)
    config, known = config_of(found.header), map_of(found.header)
    if config.program is not None:
        raise ConfigError(
            "the run of a program", file=path, expected="a recording of a truck in road load"
        )
    told = config_file.with_values(config, {"regulator.friction": str(parameter_file(parameters))})
    driver = RecordedTorque(torque=wheel_torque(found, told, known))
    judged = SCAN * driver.samples_within(config)

    def run(twin: Twin) -> TwinRun:
        return closed_loop.run(twin, lambda: driver, judged)

    twin = Twin(config=config, parameters=bench, map=known)
    return RecordedBudget(
        recording=path,
        parameters=parameters,
        budget=budget(twin, told, run),
        judged=judged,
        duration=SCAN * len(driver.torque),
    )


def parameter_file(parameters: str, folder: Path = Path()) -> Path:
    """File of a parameter set, given by its shipped name or its path from a folder on."""
    shipped = parameter_sets.FOLDER / f"{parameters}.toml"
    return shipped if shipped.is_file() else folder / parameters
