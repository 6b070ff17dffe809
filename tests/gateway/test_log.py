"""CSV logs: what is read, and what is refused with file, line, column and what was expected."""

import gzip
from pathlib import Path

import pytest

from gateway.log import LogError, read

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
    assert read(log(tmp_path, f"{HEADER}\n{ROWS}")).missing() == [
        "armature_current_A",
        "wheel_torque_Nm",
        "armature_voltage_V",
        "shell_temperature_degC",
    ]


def test_a_compressed_log_is_read_as_the_plain_one(tmp_path: Path) -> None:
    path = tmp_path / "log.csv.gz"
    with gzip.open(path, "wt") as file:
        file.write(f"{HEADER}\n{ROWS}")
    assert read(path).columns["motor_speed"].tolist() == [0.0, 0.5]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (f"{HEADER}\n0,0,0,0,0\n0,0,0,0,0\n", [":3", "time_s", "0.0", "expected more than"]),
        (f"{HEADER}\n0,0,nan,0,0\n", [":2", "motor_speed_rad_s", "nan", "expected a finite"]),
        (f"{HEADER}\n0,0,inf,0,0\n", [":2", "motor_speed_rad_s", "inf", "expected a finite"]),
        (f"{HEADER}\n0,0,0,0,x\n", [":2", "shaft_torque_Nm", "'x'", "expected a finite"]),
        (f"{HEADER}\n0,0,0,0\n", [":2", "4", "expected 5 values"]),
        (f"{HEADER}\n0,0,0,0,0,0\n", [":2", "6", "expected 5 values"]),
        (f"{HEADER}\n0,0,0,0,0\n", ["expected at least 2 samples"]),
        ("", [":1", "time_s", "is missing"]),
        (HEADER.replace("drum_speed_rad_s", "other"), [":1", "drum_speed_rad_s", "is missing"]),
        (HEADER.replace("rad_s", "rpm", 1), [":1", "speed_reference_rpm", "_rad_s"]),
        (f"{HEADER},armature_current_mA", [":1", "armature_current_mA", "armature_current_A"]),
        (f"{HEADER},armature_current", [":1", "armature_current", "armature_current_A"]),
        (f"{HEADER},{HEADER}", [":1", "time_s", "twice"]),
    ],
)
def test_a_bad_log_is_refused_with_its_place(tmp_path: Path, text: str, says: list[str]) -> None:
    path = log(tmp_path, text)
    with pytest.raises(LogError) as caught:
        read(path)
    assert str(path) in str(caught.value)
    for part in says:
        assert part in str(caught.value)
    assert caught.value.exit_code == 2


def test_a_file_that_is_not_there_or_not_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError):
        read(tmp_path / "none.csv")
    binary = tmp_path / "binary.csv.gz"
    binary.write_bytes(b"\x1f\x8b\x08\x00 not really")
    with pytest.raises(LogError):
        read(binary)


def test_a_column_of_the_gateway_is_not_taken_for_a_signal_in_a_wrong_unit(tmp_path: Path) -> None:
    text = f"{HEADER},motor_speed_setpoint_rad_s\n0,0,0,0,0,1\n1,0,0,0,0,1\n"
    assert "motor_speed" in read(log(tmp_path, text)).columns
