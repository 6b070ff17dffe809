"""The programs against the references that the independent bench logged."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.errors import ParameterError
from plant_emulator.signals.log import Log
from plant_emulator.simulation.programs import (
    PROGRAMS,
    SpeedProgram,
    TravelProgram,
    program,
    sample_times,
)
from register_maps.logs.drive_programs import Sweep

ReadLog = Callable[[str], Log]


@pytest.mark.parametrize("name", ["program1", "program2", "program3", "program4"])
def test_reference_is_the_logged_one(bench_log: ReadLog, name: str) -> None:
    log, known = bench_log(f"bench_nominal/{name}"), program(name)
    assert isinstance(known, SpeedProgram)
    time, reference = known.reference()
    np.testing.assert_allclose(time, log.time, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(reference, log["speed_reference"], rtol=0.0, atol=1e-5)


@pytest.mark.parametrize(("name", "mass"), [("program6", 3640.0), ("program6L", 5240.0)])
def test_travel_program_is_30_seconds_of_its_truck(name: str, mass: float) -> None:
    known = program(name)
    assert isinstance(known, TravelProgram)
    assert (known.duration, known.mass) == (30.0, mass)


def test_every_program_that_users_know_is_there() -> None:
    assert set(PROGRAMS) == {
        "program1", "program2", "program3", "program4", "program6", "program6L",
    }  # fmt: skip


def test_unknown_program_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ParameterError, match=r"program5: no such program; known: program1"):
        program("program5")


def test_sample_times_have_both_ends_and_do_not_drift() -> None:
    times = sample_times(0.3, 0.1)
    assert times == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert len(sample_times(18.5)) == 1851


def test_sweep_is_nothing_outside_of_its_time() -> None:
    sweep = Sweep(start=1.0, end=3.0, amplitude=5.0, first_frequency=1.0, last_frequency=1.0)
    values = [sweep.value(time) for time in (0.0, 1.0, 3.0, 4.0)]
    assert values == pytest.approx([0.0] * 4)


def test_sweep_of_constant_frequency_is_a_sine() -> None:
    sweep = Sweep(start=1.0, end=5.0, amplitude=5.0, first_frequency=1.0, last_frequency=1.0)
    assert [sweep.value(time) for time in (2.25, 2.75, 3.125)] == pytest.approx(
        [5.0, -5.0, 5.0 * np.sin(np.pi / 4)]
    )
