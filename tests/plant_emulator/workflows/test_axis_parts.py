"""Parts in time, holes, and many files as one run."""

from pathlib import Path

import numpy as np
import pytest

from plant_emulator.errors import LogError
from plant_emulator.signals.axis_log import AxisLog
from plant_emulator.workflows.diagnosis.axis_parts import read_runs, without_holes

SAMPLES = 1000


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return written(tmp_path / "run.csv")


def written(path: Path) -> Path:
    """A run of 10 s at 100 Hz."""
    rows = (f"{0.01 * k:.2f},{np.sin(0.02 * k):.4f},{np.cos(0.02 * k):.4f}" for k in range(SAMPLES))
    path.write_text("time_s,position_rad,torque_Nm\n" + "\n".join(rows) + "\n")
    return path


def spans(logs: list[AxisLog]) -> list[tuple[float, float]]:
    return [(float(log.time[0]), float(log.time[-1])) for log in logs]


def test_a_part_is_cut_in_time(file: Path) -> None:
    fitted, predicted = read_runs([f"{file}@:4"], [f"{file}@6:8"])
    assert spans(fitted) == [(0.0, 3.99)]
    assert spans(predicted) == [(6.0, 7.99)]
    assert predicted[0].source == f"{file}@6:8"


def test_what_is_held_out_of_a_file_is_not_fitted(file: Path) -> None:
    fitted, predicted = read_runs([file], [f"{file}@4:6.5"])
    assert spans(fitted) == [(0.0, 3.99), (6.5, 9.99)]
    assert spans(predicted) == [(4.0, 6.49)]


def test_one_file_is_fitted_on_its_first_part(file: Path) -> None:
    fitted, predicted = read_runs([file], [])
    assert spans(fitted) == [(0.0, 5.99)]
    assert spans(predicted) == [(6.0, 9.99)]


def test_many_files_are_runs_and_one_run_is_divided_by_its_time(tmp_path: Path) -> None:
    files = [written(tmp_path / f"{name}.csv") for name in "abc"]
    assert len(read_runs(files, [])[0]) == 3
    fitted, predicted = read_runs(files, [], one_run=True)
    # 60 % of 30 s lie 8 s into the second file
    assert spans(fitted) == [(0.0, 9.99), (0.0, pytest.approx(7.98, abs=0.02))]
    assert spans(predicted)[1] == (0.0, 9.99)
    assert [log.source for log in (fitted[0], predicted[1])] == [str(files[0]), str(files[2])]


def test_a_hole_divides_a_run(file: Path) -> None:
    [log], _ = read_runs([file], [file])
    kept = (log.time < 3.0) | (log.time > 5.0)
    holed = AxisLog(
        time=log.time[kept],
        position=log.position[kept],
        force=log.force[kept],
        rotary=True,
        source="run.csv",
    )
    assert spans(without_holes(holed)) == [(0.0, 2.99), (5.01, 9.99)]
    assert without_holes(log) == [log]


@pytest.mark.parametrize(
    ("part", "told"),
    [
        ("30:", "0 samples; a part between 0 and 9.99 s"),
        ("3:2", "the end is not after the start"),
        ("-:2", "FILE@START:END is expected"),
    ],
)
def test_a_part_that_is_none_is_refused(file: Path, part: str, told: str) -> None:
    with pytest.raises(LogError, match=told):
        read_runs([f"{file}@{part}"], [])
