"""`diagnose --model axis` on logs that cannot be right: one line says what is wrong."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from plant_emulator.cli import main
from tests.plant_emulator.axis_motion import Array, motion

TIME, POSITION, VELOCITY, TORQUE = motion()
HEADER = "time_s,position_rad,torque_Nm"
FAST = 500 + int(np.argmax(np.abs(VELOCITY[500:1000])))
ENCODER = np.round(POSITION / (2.0 * np.pi / 4096)) * (2.0 * np.pi / 4096)


def stopped(position: Array) -> Array:
    """The position, frozen from a fast sample on."""
    return np.where(np.arange(len(position)) < FAST, position, position[FAST])


def refused(folder: Path, header: str, *columns: Array) -> str:
    """The one line with which a log of these columns is refused."""
    path = folder / "run.csv"
    np.savetxt(
        path, np.stack(columns, axis=1), fmt="%.7f", delimiter=",", header=header, comments=""
    )
    result = CliRunner().invoke(main, ["diagnose", "--model", "axis", str(path)])
    assert result.exit_code == 2
    [line] = result.output.strip().splitlines()
    assert line.startswith(f"error: {path}")
    return line


@pytest.mark.parametrize(
    ("position", "torque", "told"),
    [
        (POSITION, -TORQUE, "wrong sign: the torque points against the acceleration"),
        (ENCODER * 180.0 / np.pi, TORQUE, "divide 360 and not 2 pi, as degrees do"),
        (
            POSITION * 40.0 * 180.0 / np.pi,
            TORQUE,
            "hardly in rad but perhaps in deg; give",
        ),
        (POSITION, TORQUE * 1000.0, "hardly in Nm but perhaps in mNm; give --column force="),
        (stopped(POSITION), TORQUE, "the position is frozen: exactly"),
        (np.full(len(TIME), 0.5), TORQUE, "the position is frozen: it is 0.5 in all samples"),
        (POSITION, np.full(len(TIME), 0.5), "the torque is frozen: it is 0.5 in all samples"),
    ],
)
def test_a_log_that_cannot_be_right_is_refused(
    tmp_path: Path, position: Array, torque: Array, told: str
) -> None:
    assert told in refused(tmp_path, HEADER, TIME, position, torque)


def test_a_missing_column_is_told_with_the_names_that_would_do(tmp_path: Path) -> None:
    line = refused(tmp_path, "time_s,position_rad,iq", TIME, POSITION, TORQUE)
    assert "no column for the force; it has time_s, position_rad, iq" in line
    assert "force_N or torque_Nm is needed, or --column force=COLUMN:Nm" in line


def test_help_names_the_columns_that_need_no_choice() -> None:
    told = CliRunner().invoke(main, ["diagnose", "--help"]).output
    for name in ("velocity_rad_s", "load_torque_Nm", "temperature_degC", "NAME=COLUMN[*FACTOR]"):
        assert name in told


def test_columns_belong_to_the_axis(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["diagnose", "run.csv", "--column", "position=enc:deg"])
    assert result.exit_code == 2
    assert "--column belongs to --model axis" in result.output
