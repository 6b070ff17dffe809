"""Planned runs: drive programs that a bench has not driven yet.

They are simulated without noise at a fit to the logs, and are judged by the noise of those logs. A
log shows a program where it has its reference. A log with a truck shows both travel programs,
because their references depend on the bench. A start with a cold gear is a run of its own.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.errors import UnsettledError
from plant_emulator.identification.experiment_design import noise_levels
from plant_emulator.model.stage import split_gap_position
from plant_emulator.recordings.preflight import LEAST_MOTION, NAMES
from plant_emulator.recordings.recording import Recording
from plant_emulator.signals.log import VOLTAGE, Log, compared_channels
from plant_emulator.simulation.programs import PROGRAMS, SpeedProgram, TravelProgram, describe
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import simulate
from plant_emulator.simulation.travel_program import simulate_travel

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.model.sensors import Sensor
    from plant_emulator.simulation.programs import Program

    Values = Mapping[str, float]

# A log shows a program if its reference differs by less than this [rad/s rms], over this share of
# the program.
SAME_REFERENCE, SHOWN_SHARE = 5.0, 0.9
# Temperature of the gear's shell after a night, and the temperature below which it is cold [K].
COLD_SHELL, COLD_BELOW = 293.15, 298.15
# Step of the bench that a planned truck's reference comes from [s]. The run itself is simulated
# afterwards with this reference, so that a coarse one serves.
PLANNED_STEP = 1e-3


def shows_program(log: Log, program: Program) -> bool:
    """Whether a log is a run of this program."""
    if not isinstance(program, SpeedProgram):
        return "wheel_torque" in log
    if "wheel_torque" in log:
        return False
    time, reference = program.reference()
    off = log["speed_reference"] - np.interp(log.time - log.time[0], time, reference)
    long_enough = np.ptp(log.time) >= SHOWN_SHARE * program.duration
    return bool(long_enough and np.sqrt(np.mean(off**2)) < SAME_REFERENCE)


def remaining_programs(logs: Sequence[Log]) -> list[Program]:
    """Programs that no log shows, those without a truck first."""
    rest = [p for p in PROGRAMS.values() if not any(shows_program(log, p) for log in logs)]
    return sorted(rest, key=lambda p: not isinstance(p, SpeedProgram))


def has_cold_start(logs: Sequence[Log]) -> bool:
    """Whether a log shows a gear that started cold."""
    name = "shell_temperature"
    return any(name in log and log[name][0] < COLD_BELOW for log in logs)


def planned_runs(
    recordings: Sequence[Recording], parameters: ParameterSet, warm: Values, from_cold: Values
) -> Iterator[Recording]:
    """Simulate the runs not driven yet, of least effort first: warm, cold start, with a truck.

    parameters : at the fit; a truck's reference follows from them
    warm, from_cold : all values of the simulation, with the states of the last log or of a cold
        start
    """
    logs = [r.log for r in recordings]
    rest = remaining_programs(logs)
    levels = noise_levels(recordings)
    shell, sensors = _last_shell(logs), parameters.sensors
    for speeds in (p for p in rest if isinstance(p, SpeedProgram)):
        yield from _simulate_recording(
            describe(speeds), speeds.inputs(), warm, levels, shell, sensors
        )
    if not has_cold_start(logs):
        speeds = max(
            (p for p in PROGRAMS.values() if isinstance(p, SpeedProgram)), key=lambda p: p.duration
        )
        words = f"{speeds.name} from a cold start"
        yield from _simulate_recording(
            words, speeds.inputs(), from_cold, levels, COLD_SHELL, sensors
        )
    for cycle in (p for p in rest if isinstance(p, TravelProgram)):
        with suppress(UnsettledError):
            inputs = simulate_travel(cycle, parameters, step=PLANNED_STEP)
            yield from _simulate_recording(describe(cycle), inputs, warm, levels, shell, sensors)


def _last_shell(logs: Sequence[Log]) -> float | None:
    known = [log["shell_temperature"] for log in logs if "shell_temperature" in log]
    return float(known[-1][0]) if known else None


def _simulate_recording(
    words: str,
    inputs: Log,
    values: Values,
    levels: Mapping[str, float],
    shell: float | None,
    sensors: Mapping[str, Sensor],
) -> Iterator[Recording]:
    """Simulate a run with these values; none where the model cannot follow it.

    words : what to do; levels : standard deviation of each channel's noise
    shell : temperature of the gear's shell [K]; None: not logged
    """
    run = inputs_of(inputs, sensors=sensors)
    with suppress(UnsettledError):
        others, gap = split_gap_position(values)
        log = simulate(run, others, gap_position=gap)
        signals = {**log.signals, "speed_reference": inputs["speed_reference"]}
        if shell is not None:
            signals["shell_temperature"] = np.full(len(log.time), shell)
        channels = tuple(levels)
        yield Recording(
            Log(log.time, signals, words),
            run,
            channels,
            np.array([levels[name] for name in channels]),
            np.ones((len(channels), len(log.time)), bool),
        )


def missing_experiments(logs: Sequence[Log], base_speed: float) -> dict[str, tuple[str, ...]]:
    """Manoeuvres, by subsystem, that would excite it and that no log contains.

    base_speed : motor speed above which the field is weakened [rad/s]
    """
    fastest = max(float(log["motor_speed"].max()) for log in logs)
    backwards = min(float(log["speed_reference"].min()) for log in logs) < -LEAST_MOTION
    voltage = any(VOLTAGE in compared_channels(log) for log in logs)
    missing = (
        (not voltage, NAMES[VOLTAGE], ("drive", "motor")),
        (
            fastest < base_speed,
            f"a run above {base_speed:.0f} rad/s, where the field is weakened",
            ("drive", "motor"),
        ),
        (not has_cold_start(logs), "a cold start", ("gear",)),
        (not backwards, "a run in the other direction", ("gear",)),
        (
            not any("wheel_torque" in log for log in logs),
            "a run with a truck on the drum",
            ("gear", "drum", "wheel_contact"),
        ),
    )
    found: dict[str, tuple[str, ...]] = {}
    for absent, words, subsystems in missing:
        for subsystem in subsystems if absent else ():
            found[subsystem] = (*found.get(subsystem, ()), words)
    return found
