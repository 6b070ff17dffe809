"""Files of drive programs: the two units, dwells, and what is refused with its line."""

import gzip
from math import pi

import pytest

from gateway.errors import ConfigError
from gateway.recordings.program_file import read


def test_a_speed_in_rpm_with_dwells(tmp_path):
    file = tmp_path / "steps.csv"
    file.write_text("time_s,speed_rpm,dwell_s\n0,0,\n5,1500,10\n8,0,0\n")
    first, second, third = read(file)
    assert (first.time, first.speed, first.dwell) == (0.0, 0.0, 0.0)
    assert (second.time, second.dwell, third.time) == (5.0, 10.0, 8.0)
    assert second.speed == pytest.approx(50.0 * pi)


def test_a_byte_order_mark_of_a_spreadsheet_is_no_part_of_the_first_column(tmp_path):
    file = tmp_path / "steps.csv"
    file.write_bytes(b"\xef\xbb\xbftime_s,speed_rpm\n0,0\n5,1500\n")
    assert [one.time for one in read(file)] == [0.0, 5.0]


def test_the_reference_of_a_log_from_its_first_sample(tmp_path):
    file = tmp_path / "run.csv.gz"
    rows = "time_s,shaft_torque_Nm,speed_reference_rad_s\n3.0,-1,0\n3.5,-2,12.5\n"
    file.write_bytes(gzip.compress(rows.encode()))
    assert [(one.time, one.speed) for one in read(file)] == [(0.0, 0.0), (0.5, 12.5)]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("time_s,speed\n0,0\n", "expected columns time_s and speed_rpm or speed_reference_rad_s"),
        ("time_s,speed_rpm\n0,0\n1,fast\n", "line 3: speed_rpm: bad value, found 'fast'"),
        ("time_s,speed_rpm\n0,0\n1\n", "line 3: speed_rpm: bad value"),
        ("time_s,speed_rpm\nnan,0\n", "line 2: time_s: bad value, found 'nan'"),
        ("time_s,speed_rpm,dwell_s\n0,0,-2\n", "line 2: dwell_s: bad value, found '-2'"),
        ("time_s,speed_rpm\n0,0\n\n1,9,5\n", "line 4: more cells than columns, found '5'"),
        ("time_s,speed_rpm,dwell\n0,0,5\n", "unknown column, found 'dwell'; expected time_s, "),
    ],
)
def test_a_file_that_is_no_program_is_refused_with_its_place(tmp_path, text, says):
    file = tmp_path / "bad.csv"
    file.write_text(text)
    with pytest.raises(ConfigError, match=says.replace("'", ".")):
        read(file)


def test_a_packed_program_that_was_cut_off_is_refused_with_its_file(tmp_path):
    file = tmp_path / "cut.csv.gz"
    file.write_bytes(gzip.compress(b"time_s,speed_rpm\n0,0\n1,100\n2,0\n")[:-12])
    with pytest.raises(ConfigError, match=r"cut\.csv\.gz: .* expected a drive program"):
        read(file)
