"""Logs in the gateway. What is read and refused: tests/register_maps/test_csv_log.py and beside."""

from pathlib import Path

import pytest

from gateway.recordings.log import LogError, read

HEADER = "time_s,speed_reference_rad_s,motor_speed_rad_s,drum_speed_rad_s,shaft_torque_Nm"
ROWS = "0.0,0,0,0,0\n0.01,1,0.5,0.01,-2\n"


def log(directory: Path, text: str) -> Path:
    path = directory / "log.csv"
    path.write_text(text)
    return path


def test_columns_come_out_by_signal_in_si(tmp_path: Path) -> None:
    text = f"{HEADER},shell_temperature_degC,note\n0.0,0,0,0,0,32,a\n0.01,1,0.5,0.01,-2,32,b\n"
    found = read(log(tmp_path, text))
    assert found.time.tolist() == [0.0, 0.01]
    assert found.columns["shaft_torque"].tolist() == [0.0, -2.0]
    assert found.columns["shell_temperature"].tolist() == pytest.approx([305.15, 305.15])
    assert "note" not in found.columns


def test_what_is_not_there_is_named(tmp_path: Path) -> None:
    assert read(log(tmp_path, f"{HEADER}\n{ROWS}")).missing_columns() == [
        "armature_current_A",
        "wheel_torque_Nm",
        "armature_voltage_V",
        "shell_temperature_degC",
    ]


def test_a_bad_log_is_refused_with_file_and_place(tmp_path: Path) -> None:
    path = log(tmp_path, f"{HEADER}\n0,0,nan,0,0\n1,0,0,0,0\n")
    with pytest.raises(LogError) as caught:
        read(path)
    says = f"{path}: line 2, column motor_speed_rad_s: 'nan'; expected a finite number"
    assert str(caught.value) == says
    assert caught.value.exit_code == 2


def test_a_file_that_is_not_there_or_not_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError):
        read(tmp_path / "none.csv")
    binary = tmp_path / "binary.csv.gz"
    binary.write_bytes(b"\x1f\x8b\x08\x00 not really")
    with pytest.raises(LogError):
        read(binary)
