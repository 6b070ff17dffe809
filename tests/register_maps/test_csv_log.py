"""A CSV log is the same log for daemon and physics: read alike, or refused alike."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from gateway.recordings import log as gateway_log
from plant_emulator import logs as emulator_logs
from plant_emulator.errors import LogError

HEADER = "time_s,speed_reference_rad_s,motor_speed_rad_s,drum_speed_rad_s,shaft_torque_Nm"
ROWS = "0.00,1.0,2.0,0.03,-4.0\n0.01,1.5,2.5,0.04,-5.0\n"
PLAIN = f"{HEADER}\n{ROWS}"


def with_column(name: str, first: str = "7", second: str = "8") -> str:
    """The plain log and one more column."""
    rows = ROWS.splitlines()
    return f"{HEADER},{name}\n{rows[0]},{first}\n{rows[1]},{second}\n"


GOOD = {
    "plain": PLAIN.encode(),
    "byte order mark": PLAIN.encode("utf-8-sig"),
    "carriage returns": PLAIN.replace("\n", "\r\n").encode(),
    "only carriage returns": PLAIN.replace("\n", "\r").encode(),
    "no last line end": PLAIN[:-1].encode(),
    "blank lines": PLAIN.replace("\n", "\n\n  \n").encode(),
    "gzip": gzip.compress(PLAIN.encode()),
    "gzip with a byte order mark": gzip.compress(PLAIN.encode("utf-8-sig")),
    "blanks round names and numbers": PLAIN.replace(",", " , ").encode(),
    "names in quotes": PLAIN.replace("motor_speed_rad_s", '"motor_speed_rad_s"').encode(),
    "numbers in quotes": PLAIN.replace("2.5", '"2.5"').encode(),
    "exponent": PLAIN.replace("2.5", "25e-1").encode(),
    "column of text": with_column("note", "cruise", "").encode(),
    "column of text in quotes": with_column("note", '"slow, then"', '"fast ""2"""').encode(),
    "column with other letters": with_column("temp\u00e9rature", "\u2028", "\u0663").encode(),
    "column with underscores": with_column("note", "1_000", "_").encode(),
    "second unit of a signal that is there": with_column("motor_speed_rpm").encode(),
    "column of the gateway": with_column("motor_speed_setpoint_rad_s").encode(),
    "column like a signal that is not there": with_column("shell_temperature_2_K").encode(),
    "two columns without a name": (PLAIN.replace("\n", ",,\n")).encode(),
}
BAD = {
    "no byte": (b"", ""),
    "speed of no machine": (
        PLAIN.replace("2.5", "1e308").encode(),
        "line 3, column motor_speed_rad_s: 1e308; expected -10000 .. 10000",
    ),
    "torque of no machine": (
        PLAIN.replace("-4.0", "-1.1e6").encode(),
        "line 2, column shaft_torque_Nm: -1.1e6; expected -1e+06 .. 1e+06",
    ),
    "current of no machine": (
        with_column("armature_current_A", "1", "100001").encode(),
        "line 3, column armature_current_A: 100001; expected -100000 .. 100000",
    ),
    "time of no clock": (PLAIN.replace("0.01,", "1e300,").encode(), "line 3, column time_s: 1e300"),
    "sampled too fast for any bench": (
        PLAIN.replace("0.01,", "1e-11,").encode(),
        "a sample every 1e-11 s; expected one every 0.0001 .. 10 s",
    ),
    "sampled too slowly for any bench": (
        PLAIN.replace("0.01,", "1e7,").encode(),
        "a sample every 1e+07 s; expected one every 0.0001 .. 10 s",
    ),
    "hole": (
        (PLAIN + "0.02,1.0,2.0,0.03,-4.0\n10.03,1.0,2.0,0.03,-4.0\n").encode(),
        "no sample from 0.02 s to 10.03 s",
    ),
    "header only": (f"{HEADER}\n".encode(), "0 samples; at least 2"),
    "one sample": (PLAIN[: PLAIN.index("0.01")].encode(), "1 samples; at least 2"),
    "semicolons": (PLAIN.replace(",", ";").encode(), ""),
    "not UTF-8": (PLAIN.encode() + b"\xff", f"byte {len(PLAIN)}: not UTF-8"),
    "cut gzip": (gzip.compress(PLAIN.encode())[:-9], "damaged gzip file"),
    "quote that does not end": (PLAIN.replace("2.5", '"2.5').encode(), "unexpected end"),
    "column twice": (PLAIN.replace("drum", "motor").encode(), "motor_speed_rad_s stands twice"),
    "column missing": (PLAIN.replace("drum_speed_rad_s", "x").encode(), "drum_speed_rad_s is miss"),
    "time in ms": (PLAIN.replace("time_s", "time_ms").encode(), "time_ms; expected time_s"),
    "speed in rpm": (
        PLAIN.replace("drum_speed_rad_s", "drum_speed_rpm").encode(),
        "line 1: column drum_speed_rpm; expected drum_speed_rad_s",
    ),
    "current in mA": (with_column("armature_current_mA").encode(), "expected armature_current_A"),
    "current without unit": (with_column("armature_current").encode(), "armature_current_A"),
    "too few values": (PLAIN.replace(",-5.0", "").encode(), "line 3: 4 values; 5 columns"),
    "too many values": (PLAIN.replace("-5.0", "-5.0,1").encode(), "line 3: 6 values; 5 columns"),
    "decimal comma": (PLAIN.replace("2.5", "2,5").encode(), "line 3: 6 values; 5 columns"),
    "no number": (
        PLAIN.replace("2.5", "fast").encode(),
        "line 3, column motor_speed_rad_s: 'fast'; expected a number",
    ),
    "empty cell": (PLAIN.replace("2.5", "").encode(), "motor_speed_rad_s: ''; expected a number"),
    "underscore in a number": (PLAIN.replace("2.5", "2_5").encode(), "'2_5'; expected a number"),
    "digits of another script": (
        PLAIN.replace("2.5", "\u0662").encode(),
        "'\u0662'; expected a number",
    ),
    "nan": (PLAIN.replace("2.5", "nan").encode(), "'nan'; expected a finite number"),
    "infinite": (PLAIN.replace("2.5", "1e999").encode(), "'1e999'; expected a finite number"),
    "time stands": (PLAIN.replace("0.01,", "0.0,").encode(), "line 3, column time_s: 0.0 after 0;"),
    "time goes back": (PLAIN.replace("0.01,", "-1,").encode(), "time must increase strictly"),
}


@pytest.mark.parametrize("name", ["run.csv", "run.csv.gz"])
@pytest.mark.parametrize("content", GOOD.values(), ids=GOOD)
def test_good_log_gives_both_the_same_numbers(tmp_path: Path, content: bytes, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    daemon, physics = gateway_log.read(path), emulator_logs.read(path)
    assert daemon.columns.keys() == physics.signals.keys()
    assert daemon.time.tolist() == physics.time.tolist() == [0.0, 0.01]
    for signal, values in daemon.columns.items():
        np.testing.assert_array_equal(physics[signal], values)
    assert daemon.columns["motor_speed"].tolist() == [2.0, 2.5]
    assert daemon.columns["shaft_torque"].tolist() == [-4.0, -5.0]


@pytest.mark.parametrize(("content", "says"), BAD.values(), ids=BAD)
def test_bad_log_is_refused_by_both_with_its_place(
    tmp_path: Path, content: bytes, says: str
) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes(content)
    with pytest.raises(gateway_log.LogError) as daemon:
        gateway_log.read(path)
    with pytest.raises(LogError) as physics:
        emulator_logs.read(path)
    for error in (daemon.value, physics.value):
        assert str(error).startswith(f"{path}: ")
        assert says in str(error)
        assert "\n" not in str(error)
        assert error.exit_code == 2


def test_temperature_is_read_in_kelvin_by_both(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(with_column("shell_temperature_degC", "32", "-273.15"))
    wanted = pytest.approx([305.15, 0.0])
    assert gateway_log.read(path).columns["shell_temperature"] == wanted
    assert emulator_logs.read(path)["shell_temperature"] == wanted


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("0.01,", "0.0001,"),
        ("0.01,", "10.0,"),
        ("2.5", "1e4"),
        ("-4.0", "-1e6"),
        ("\n0.0", "\n1795251661.0"),
    ],
)
def test_a_log_at_the_end_of_what_may_be_is_read(tmp_path: Path, before: str, after: str) -> None:
    path = tmp_path / "run.csv"
    path.write_text(PLAIN.replace(before, after))
    assert len(gateway_log.read(path).time) == len(emulator_logs.read(path).time) == 2
