"""Reading runs of an axis: CSV and two layouts of MATLAB files."""

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from plant_emulator.errors import LogError
from plant_emulator.workflows import axis_reader
from plant_emulator.workflows.loading import check_unlabelled

TIME = np.arange(5) * 1e-3
LINEAR = "time_s,position_m,force_N,label\n0,0.1,5,1\n0.001,0.2,-6.5,1\n0.002,0.3,7,1\n"
ROTARY = "time_s,position_rad,torque_Nm\n0,0.1,5\n0.001,0.2,-6.5\n0.002,0.3,7\n"


def written(folder: Path, text: str, name: str = "run.csv") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def screw(folder: Path, **changed: Any) -> Path:
    path = folder / "screw.mat"
    column = TIME[:, None]
    content = {
        "t": column,
        "qm": 2.0 * column,
        "vir": column + 1.0,
        "gtau": 35.0,
        "pulses_N": column * 0.0 + 5.0,
    }
    savemat(path, content | changed)
    return path


def motor(folder: Path, **changed: Any) -> Path:
    path = folder / "motor.mat"
    columns = [TIME, 0 * TIME, 3.0 * TIME, 0 * TIME, 0 * TIME, 9.0 + TIME, 2.0 + TIME]
    savemat(path, {"data": np.stack(columns, axis=1), "Cu": 0.0458} | changed)
    return path


def test_a_linear_axis_is_read_from_csv(tmp_path: Path) -> None:
    log = axis_reader.read(written(tmp_path, LINEAR))
    assert not log.rotary
    assert log.time.tolist() == [0.0, 0.001, 0.002]
    assert log.position.tolist() == [0.1, 0.2, 0.3]
    assert log.force.tolist() == [5.0, -6.5, 7.0]
    assert log.other == ("label",)
    assert log.source == str(tmp_path / "run.csv")


def test_a_rotary_axis_is_read_from_compressed_csv(tmp_path: Path) -> None:
    path = tmp_path / "run.csv.gz"
    path.write_bytes(gzip.compress(ROTARY.encode()))
    log = axis_reader.read(path)
    assert log.rotary
    assert log.position.tolist() == [0.1, 0.2, 0.3]
    assert log.force.tolist() == [5.0, -6.5, 7.0]


def test_the_force_of_a_screw_is_its_gain_times_its_command(tmp_path: Path) -> None:
    log = axis_reader.read(screw(tmp_path))
    assert not log.rotary
    assert log.position == pytest.approx(2.0 * TIME)
    # 35 N/V times 1 V at the start; the pulses are in the command already
    assert log.force[0] == pytest.approx(35.0)
    assert log.force[4] == pytest.approx(35.14)


def test_the_torque_of_a_motor_is_its_constant_times_its_current(tmp_path: Path) -> None:
    log = axis_reader.read(motor(tmp_path))
    assert log.rotary
    assert log.position == pytest.approx(3.0 * TIME)
    assert log.force == pytest.approx(0.0458 * (2.0 + TIME))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "time_s,position_m\n0,1\n1,2\n",
            "line 1: no column for the force; it has time_s, position_m; force_N",
        ),
        (
            "time_s,position_mm,force_N\n0,1,1\n1,2,2\n",
            "column position_mm is in mm: say so by --column position=position_mm:mm",
        ),
        (
            "time_s,position_rad,torque_mNm\n0,1,1\n1,2,2\n",
            "column torque_mNm is in mNm: say so by --column force=torque_mNm:mNm",
        ),
        (
            "time_s,position_m,force_N\n0,1,1\n1,nan,2\n",
            "line 3, column position_m: nan; a finite number",
        ),
        ("time_s,position_m,force_N\n1,1,1\n1,2,2\n", "line 3, column time_s: 1 after 1"),
    ],
)
def test_a_csv_that_is_none_is_refused_with_its_place(tmp_path: Path, text: str, told: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(LogError) as caught:
        axis_reader.read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert told in str(caught.value)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"qm": np.zeros((5, 2))}, "no column for the time; it has t, qm(:,1), qm(:,2), vir"),
        ({"qm": TIME[:4]}, "no column qm; it has t, vir, pulses_N"),
        ({"gtau": [1.0, 2.0]}, "no column for the time; it has t, qm, vir, pulses_N"),
        ({"vir": TIME * np.nan}, "row 1, column vir: nan"),
        ({"t": TIME[::-1]}, "row 2, column t: 0.003 after 0.004; time must increase"),
        ({"t": "abc"}, "no column for the time; it has qm, vir, pulses_N"),
    ],
)
def test_a_screw_with_bad_variables_is_refused(
    tmp_path: Path, changed: dict[str, Any], told: str
) -> None:
    path = screw(tmp_path, **changed)
    with pytest.raises(LogError) as caught:
        axis_reader.read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert told in str(caught.value)


def test_a_motor_without_its_seven_columns_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"it has data\(:,1\), data\(:,2\), data\(:,3\)"):
        axis_reader.read(motor(tmp_path, data=np.zeros((5, 3))))


def test_other_variables_are_told(tmp_path: Path) -> None:
    path = tmp_path / "other.mat"
    savemat(path, {"speed": TIME, "torque": TIME})
    with pytest.raises(LogError, match=r"other\.mat: variables: .* it has speed, torque"):
        axis_reader.read(path)


def test_a_damaged_matlab_file_is_told(tmp_path: Path) -> None:
    path = screw(tmp_path)
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(LogError, match=r"screw\.mat: no readable MATLAB file"):
        axis_reader.read(path)


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"nothing\.csv: no such file"):
        axis_reader.read(tmp_path / "nothing.csv")


def test_a_variable_that_looks_like_the_answer_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    time = np.arange(100.0) * 1e-3
    savemat(path, {"t": time, "qm": time, "vir": time, "gtau": 2.0, "true_effect": "friction"})
    with pytest.raises(LogError, match=r"run\.mat: variable true_effect looks like"):
        check_unlabelled(axis_reader.read(path))
