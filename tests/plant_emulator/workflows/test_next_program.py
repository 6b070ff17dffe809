"""The next experiment as a drive program: the gateway reads what the diagnosis writes."""

import numpy as np
import pytest

from gateway.recordings import program_file
from plant_emulator.errors import ParameterError
from plant_emulator.workflows.next_program import write_next_program


def test_the_gateway_reads_the_reference_that_the_independent_bench_logged(tmp_path, bench_log):
    file = tmp_path / "next.csv"
    advised = "Drive program4 (60 s, to 350 rad/s, with sweeps): there stribeck differs."
    assert write_next_program(advised, file).startswith("program4 (60 s")
    log = bench_log("bench_nominal/program4")
    points = program_file.read(file)
    read = np.interp(log.time, [one.time for one in points], [one.speed for one in points])
    np.testing.assert_allclose(read, log["speed_reference"], rtol=0.0, atol=1e-3)


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
