"""Files of other programs, read as they wrote them."""

import gzip
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from plant_emulator.errors import LogError
from plant_emulator.signals.axis_log import AxisLog
from plant_emulator.workflows.axis_reader import read
from register_maps.logs import mdf4_log, parquet_log
from register_maps.logs.log_table import Column

COLUMNS = ("time=t:ms", "position=enc:deg", "force=iq*0.40:Nm")
FORCE = COLUMNS[2]
TIME = np.array([0.0, 10.0, 20.0])
ENCODER, CURRENT = np.array([0.0, 90.5, -180.0]), np.array([1.0, -2.5, 4.0])


def is_the_run(log: AxisLog) -> bool:
    """Whether these are the numbers above, by hand: s, rad, N m."""
    return (
        log.rotary
        and np.allclose(log.time, [0.0, 0.01, 0.02])
        and np.allclose(log.position, [0.0, 1.579523, -3.141593])
        and np.allclose(log.force, [0.4, -1.0, 1.6])
    )


@pytest.mark.parametrize(
    "text",
    [
        "t,enc,iq,mode\n0,0,1,auto\n10,90.5,-2.5,auto\n20,-180,4,auto\n",
        "t;enc;iq\n0;0;1\n10;90,5;-2,5\n20;-1,8e2;4\n",
        "# logger 3\n# 2026-01-02\nt\tenc\tiq\n0\t0\t1\n\n10\t90.5\t-2.5\n% end\n20\t-180\t4\n",
        "Machine;arm\nStarted;08:15\nt;enc;iq\nms;deg;A\n0;0;1\n10;90,5;-2,5\n20;-180;4\n",
        "  t   enc   iq\n  0  0  1\n 10  90.5  -2.5\n 20 -180   4\n",
        "# t enc iq\n0 0 1\n10 90.5 -2.5\n20 -180 4\n",
        't,"enc",iq,"note, long"\r\n0,0,1,"a, b"\r\n10,90.5,-2.5,x\r\n20,-180,4,x\r\n',
    ],
)
def test_any_usual_text_is_read(tmp_path: Path, text: str) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes(gzip.compress(text.encode()))
    assert is_the_run(read(path, COLUMNS))


def test_a_file_without_names_has_numbered_columns(tmp_path: Path) -> None:
    path = tmp_path / "run.txt"
    path.write_text("0 0 1\n10 90.5 -2.5\n20 -180 4\n")
    assert is_the_run(read(path, ["time=1:ms", "position=2:deg", "force=3*0.4:Nm"]))


def test_units_in_brackets_need_no_choice(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("Time [ms];Position [deg];Torque [mNm]\n0;0;400\n10;90,5;-1000\n20;-180;1600\n")
    assert is_the_run(read(path))


def test_a_text_in_another_encoding_is_read(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes("t;Winkel [°];iq\n0;0;1\n10;90,5;-2,5\n20;-180;4\n".encode("cp1252"))
    assert is_the_run(read(path, ["time=t:ms", "position=Winkel [°]", "force=iq*0.4:Nm"]))


def test_matlab_vectors_matrices_and_structures_are_read(tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    savemat(path, {"t": TIME, "data": np.stack([ENCODER, CURRENT], axis=1), "log": {"iq": CURRENT}})
    for current in ("data(:,2)", "log.iq"):
        chosen = ["time=t:ms", "position=data(:,1):deg", f"force={current}*0.4:Nm"]
        log = read(path, chosen)
        assert is_the_run(log)
        assert len(log.other) == 1


def test_parquet_and_mdf4_are_read_with_their_units(tmp_path: Path) -> None:
    columns = [
        Column(name="time", unit="s", values=TIME * 1e-3),
        Column(name="enc", unit="deg", values=ENCODER),
        Column(name="torque", unit="mNm", values=CURRENT * 400.0),
    ]
    for name, data in {
        "run.parquet": parquet_log.encode(columns),
        "run.mf4": mdf4_log.encode(columns, start=datetime(2026, 1, 2, tzinfo=UTC)),
    }.items():
        path = tmp_path / name
        path.write_bytes(data)
        assert is_the_run(read(path, {"position": "enc"}))


def test_a_velocity_stands_in_for_a_position(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time_s,n,torque_Nm\n0,0,1\n0.1,60,1\n0.3,60,1\n")
    log = read(path, ["velocity=n:rpm"])
    assert log.velocity == pytest.approx([0.0, 2.0 * np.pi, 2.0 * np.pi])
    # by the trapezoidal rule: a twentieth of a revolution, then a fifth
    assert log.position == pytest.approx([0.0, 0.1 * np.pi, 0.5 * np.pi])


def test_an_encoder_that_begins_anew_each_revolution_is_continued(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    angles = [340, 355, 5, 20, 10, 357, 350]
    rows = "".join(f"{0.1 * k},{angle},1\n" for k, angle in enumerate(angles))
    path.write_text(f"time_s,enc,torque_Nm\n{rows}")
    log = read(path, ["position=enc:deg"])
    continued = [340.0, 355.0, 365.0, 380.0, 370.0, 357.0, 350.0]
    assert np.degrees(log.position) == pytest.approx(continued)


def test_load_and_temperature_are_read(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time_s,position_m,force_N,load_force_N,T\n0,0,1,5,300\n0.1,1,2,6,310\n")
    log = read(path, ["temperature=T:K"])
    assert not log.rotary
    assert log.load == pytest.approx([5.0, 6.0])
    assert log.temperature == pytest.approx([26.85, 36.85])


@pytest.mark.parametrize(
    ("columns", "told"),
    [
        (["position=encoder:deg", FORCE], "no column encoder; it has t, enc, iq"),
        (["position=enc", FORCE], "column enc: no unit is known; write it as in --column"),
        (["position=enc:Nm", FORCE], "'Nm' is no unit of a position"),
        (["position=enc:deg", "force=iq:A"], "'A' is no unit of a force"),
        (["position=enc:mm", "force=iq:Nm"], "an angle needs a torque and a length a force"),
        (["position=enc:deg"], "no column for the force; it has t, enc, iq"),
    ],
)
def test_a_choice_that_does_not_fit_is_refused(
    tmp_path: Path, columns: list[str], told: str
) -> None:
    path = tmp_path / "run.csv"
    path.write_text("t,enc,iq\n0,0,1\n10,90.5,-2.5\n20,-180,4\n")
    with pytest.raises(LogError) as caught:
        read(path, ["time=t:ms", *columns])
    assert told in str(caught.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("t,enc,iq\n0,0,1\n10,90.5\n20,3,4\n30,4,5\n", "line 3: 2 values; 3 columns"),
        ("t,enc,iq\n0,0,1\n10,x,3\n20,3,4\n", "line 3, column enc: 'x'; expected a number"),
        ("t,t,iq\n0,0,1\n10,90.5,4\n", "line 1: column t stands twice"),
        ("nothing here\nat all\n", "no table of numbers"),
        ("", "no table of numbers"),
    ],
)
def test_a_damaged_text_is_refused_with_its_line(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "run.csv"
    path.write_text(text)
    with pytest.raises(LogError) as caught:
        read(path, COLUMNS)
    assert told in str(caught.value)
