"""Which drive programs logs show, and what logs lack."""

import numpy as np

from plant_emulator.diagnosis.machines.bench_programs import (
    missing_experiments,
    remaining_programs,
    shows_program,
)
from plant_emulator.signals.log import Array, Log
from plant_emulator.simulation.programs import PROGRAMS, describe


def driven(name: str, factor: float = 1.0, **more: Array) -> Log:
    time, reference = PROGRAMS[name].reference()  # type: ignore[union-attr]
    speed = factor * reference
    return Log(time, {"speed_reference": speed, "motor_speed": speed, **more})


def test_log_shows_the_program_whose_reference_it_has():
    assert shows_program(driven("program2"), PROGRAMS["program2"])
    assert not shows_program(driven("program2", 0.9), PROGRAMS["program2"])
    assert not shows_program(driven("program3"), PROGRAMS["program2"])
    rest = [p.name for p in remaining_programs([driven(f"program{k}") for k in (1, 2, 3)])]
    assert rest == ["program4", "program6", "program6L"]
    truck = driven("program1", wheel_torque=np.zeros(1851))
    assert [p.name for p in remaining_programs([truck])] == [
        "program1",
        "program2",
        "program3",
        "program4",
    ]


def test_what_logs_lack_is_told_of_the_blocks_that_it_tells_of():
    slow = driven("program1", 0.3)
    assert (
        "a run above 190 rad/s, where the field is weakened"
        in missing_experiments([slow], 190.0)["motor"]
    )
    everything = driven(
        "program1",
        wheel_torque=np.zeros(1851),
        armature_voltage=np.linspace(0.0, 300.0, 1851),
        shell_temperature=np.full(1851, 288.0),
    )
    assert missing_experiments([everything], 190.0) == {"gear": ("a run in the other direction",)}
    assert missing_experiments([slow], 190.0)["drum"] == ("a run with a truck on the drum",)


def test_program_is_told_as_one_plans_it():
    assert describe(PROGRAMS["program4"]) == "program4 (60 s, to 350 rad/s, with sweeps)"
    assert describe(PROGRAMS["program6"]) == "program6 (a truck of 3640 kg on the drum)"
