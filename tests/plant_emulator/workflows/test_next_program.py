"""The next experiment as a drive program: the gateway reads what the diagnosis writes."""

import numpy as np
import pytest

from gateway.recordings import program_file
from plant_emulator.errors import LogError, ParameterError
from plant_emulator.workflows.next_program import read_drive_program, write_next_program


def test_the_gateway_reads_the_reference_that_the_independent_bench_logged(tmp_path, bench_log):
    file = tmp_path / "next.csv"
    advised = "Drive program4 (60 s, to 350 rad/s, with sweeps): there stribeck differs."
    assert write_next_program(advised, file).startswith("program4 (60 s")
    log = bench_log("bench_nominal/program4")
    points = program_file.read(file)
    read = np.interp(log.time, [one.time for one in points], [one.speed for one in points])
    np.testing.assert_allclose(read, log["speed_reference"], rtol=0.0, atol=1e-3)
    again = read_drive_program(file)
    assert again is not None
    time, reference = again.reference()
    np.testing.assert_allclose(time, log.time, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(reference, log["speed_reference"], rtol=0.0, atol=1e-3)


def test_a_log_is_no_drive_program_and_a_bad_row_is_told_with_its_line(tmp_path):
    log, program = tmp_path / "log.csv", tmp_path / "program.csv"
    log.write_text("time_s,speed_reference_rad_s,motor_speed_rad_s\n0,0,0\n")
    assert read_drive_program(log) is None
    program.write_text("time_s,speed_reference_rad_s\n0,0\n1,fast\n")
    with pytest.raises(
        LogError, match=r"program.csv: line 3, column speed_reference_rad_s: 'fast'"
    ):
        read_drive_program(program)


@pytest.mark.parametrize(
    ("advised", "why"),
    [
        (None, "it names no drive program: nothing is left to decide"),
        ("To narrow it down in the gear: start several times.", "it names no drive program"),
        ("Drive program6 (a truck of 3640 kg on the drum): ...", "it needs a truck on the drum"),
    ],
)
def test_an_experiment_that_speeds_alone_cannot_drive_writes_no_file(tmp_path, advised, why):
    with pytest.raises(ParameterError, match=why):
        write_next_program(advised, tmp_path / "next.csv")
    assert not (tmp_path / "next.csv").exists()
