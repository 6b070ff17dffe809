"""Every log format: what is written is read again, a fault is named with its place."""

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from plant_emulator import logs
from plant_emulator.errors import LogError
from plant_emulator.signals.log import Log
from register_maps.signals import LOG_COLUMNS

# column, signal, whether it is needed: what users' files hold
KNOWN = [
    ("time_s", "time", True),
    ("speed_reference_rad_s", "speed_reference", True),
    ("motor_speed_rad_s", "motor_speed", True),
    ("drum_speed_rad_s", "drum_speed", True),
    ("armature_current_A", "armature_current", False),
    ("shaft_torque_Nm", "shaft_torque", True),
    ("wheel_torque_Nm", "wheel_torque", False),
    ("armature_voltage_V", "armature_voltage", False),
    ("shell_temperature_degC", "shell_temperature", False),
    ("reference_knee_time_s", "reference_knee_time", False),
    ("reference_knee_rad_s", "reference_knee", False),
    ("reference_knee_2_time_s", "reference_knee_2_time", False),
    ("reference_knee_2_rad_s", "reference_knee_2", False),
    ("reference_knee_3_time_s", "reference_knee_3_time", False),
    ("reference_knee_3_rad_s", "reference_knee_3", False),
    ("truck_on_drum", "truck_on_drum", False),
]
HEADER = "time_s,speed_reference_rad_s,motor_speed_rad_s,drum_speed_rad_s,shaft_torque_Nm"
ROWS = ("0.00,1.0,2.0,0.03,-4.0", "0.01,1.5,2.5,0.04,-5.0", "0.02,2.0,3.0,0.05,-6.0")
SUFFIXES = [suffix for module in logs.formats() for suffix in module.SUFFIXES]


def text(header: str = HEADER, rows: tuple[str, ...] = ROWS) -> str:
    return "\n".join([header, *rows]) + "\n"


@pytest.fixture
def refused(tmp_path: Path) -> Callable[[str], str]:
    """Return a function: text of a file -> what its refusal says."""

    def says(content: str) -> str:
        path = tmp_path / "run.csv"
        path.write_text(content, encoding="utf-8")
        with pytest.raises(LogError) as refusal:
            logs.read(path)
        assert refusal.value.exit_code == 2
        assert str(refusal.value).startswith(str(path))
        assert "\n" not in str(refusal.value)
        return str(refusal.value).removeprefix(f"{path}: ")

    return says


def test_columns_are_those_that_users_know() -> None:
    assert [(c.column, c.signal, c.needed) for c in LOG_COLUMNS.values()] == KNOWN


# --- reading ----------------------------------------------------------------------------------


def test_values_are_read_in_si(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = tuple(f"{row},31.5" for row in ROWS)
    path.write_text(text(f"{HEADER},shell_temperature_degC", rows), encoding="utf-8")
    log = logs.read(path)
    assert log.time.tolist() == [0.0, 0.01, 0.02]
    assert log["shaft_torque"].tolist() == [-4.0, -5.0, -6.0]
    assert log["shell_temperature"] == pytest.approx(304.65)
    assert log.source == str(path)


def test_columns_may_stand_in_any_order(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    turned = [",".join(reversed(line.split(","))) for line in text().splitlines()]
    path.write_text("\n".join(turned), encoding="utf-8")
    assert logs.read(path)["motor_speed"].tolist() == [2.0, 2.5, 3.0]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_line_ends_and_byte_order_mark_do_not_matter(tmp_path: Path, end: str, mark: str) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes((mark + text().replace("\n", end)).encode())
    assert logs.read(path)["drum_speed"].tolist() == [0.03, 0.04, 0.05]


@pytest.mark.parametrize("cell", ["7", "", "nan", "cruise"])
def test_unknown_extra_column_is_named_and_left_alone(tmp_path: Path, cell: str) -> None:
    path = tmp_path / "run.csv"
    rows = tuple(f"{row},{cell}" for row in ROWS)
    path.write_text(text(f"{HEADER},oil_level", rows), encoding="utf-8")
    log = logs.read(path)
    assert log.other == ("oil_level",)
    assert "oil_level" not in log
    assert log["shaft_torque"].tolist() == [-4.0, -5.0, -6.0]


def test_second_unit_of_a_column_that_is_there_is_an_extra_column(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = tuple(f"{row},19.1" for row in ROWS)
    path.write_text(text(f"{HEADER},motor_speed_rpm", rows), encoding="utf-8")
    assert logs.read(path).other == ("motor_speed_rpm",)


def test_gzip_is_recognised_by_its_content(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    path.write_bytes(gzip.compress(text().encode()))
    assert len(logs.read(path).time) == 3


def test_blank_lines_are_no_samples(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(text() + "\n\n", encoding="utf-8")
    assert len(logs.read(path).time) == 3


# --- refusals ---------------------------------------------------------------------------------


@pytest.mark.parametrize("column", [name for name, _, needed in KNOWN if needed])
def test_missing_needed_column_is_refused(refused: Callable[[str], str], column: str) -> None:
    said = refused(text(HEADER.replace(column, "something")))
    assert said == f"line 1: column {column} is missing; it is needed"


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("motor_speed_rpm", "motor_speed_rad_s"),
        ("time_ms", "time_s"),
        ("shaft_torque_kNm", "shaft_torque_Nm"),
        ("drum_speed_rad", "drum_speed_rad_s"),
    ],
)
def test_wrong_unit_of_a_needed_column_is_refused(
    refused: Callable[[str], str], wrong: str, right: str
) -> None:
    assert refused(text(HEADER.replace(right, wrong))) == (
        f"line 1: column {wrong}; expected {right}"
    )


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("armature_current_mA", "armature_current_A"),
        ("wheel_torque_kNm", "wheel_torque_Nm"),
        ("shell_temperature_K", "shell_temperature_degC"),
    ],
)
def test_wrong_unit_of_an_optional_column_is_refused(
    refused: Callable[[str], str], wrong: str, right: str
) -> None:
    rows = tuple(f"{row},1.0" for row in ROWS)
    assert refused(text(f"{HEADER},{wrong}", rows)) == f"line 1: column {wrong}; expected {right}"


def test_column_that_stands_twice_is_refused(refused: Callable[[str], str]) -> None:
    rows = tuple(f"{row},1.0" for row in ROWS)
    said = refused(text(f"{HEADER},drum_speed_rad_s", rows))
    assert said == "line 1: column drum_speed_rad_s stands twice"


@pytest.mark.parametrize("cell", ["", "fast", "1,5", "0x10", "1.0.0", "#"])
def test_what_is_no_number_is_refused(refused: Callable[[str], str], cell: str) -> None:
    said = refused(text().replace("2.5", cell))
    assert said.startswith("line 3")
    if "," in cell:
        assert said == "line 3: 6 values; 5 columns are expected"
    else:
        assert said == f"line 3, column motor_speed_rad_s: {cell!r}; expected a number"


@pytest.mark.parametrize("cell", ["nan", "NaN", "inf", "-inf", "1e999"])
def test_value_that_is_not_finite_is_refused(refused: Callable[[str], str], cell: str) -> None:
    said = refused(text().replace("-6.0", cell))
    assert said == f"line 4, column shaft_torque_Nm: {cell!r}; expected a finite number"


@pytest.mark.parametrize("time", ["0.01", "0.005", "-1"])
def test_time_that_does_not_increase_is_refused(refused: Callable[[str], str], time: str) -> None:
    said = refused(text().replace("0.02,", f"{time},"))
    assert said == f"line 4, column time_s: {time} after 0.01; time must increase strictly"


@pytest.mark.parametrize("time", ["nan", "", "later"])
def test_time_that_is_no_time_is_refused(refused: Callable[[str], str], time: str) -> None:
    assert refused(text().replace("0.02,", f"{time},")).startswith("line 4, column time_s:")


@pytest.mark.parametrize("row", ["0.02,2.0,3.0,0.05", "0.02,2.0,3.0,0.05,-6.0,1.0"])
def test_row_of_another_length_is_refused(refused: Callable[[str], str], row: str) -> None:
    count = row.count(",") + 1
    said = refused(text(rows=(*ROWS[:2], row)))
    assert said == f"line 4: {count} values; 5 columns are expected"


def test_row_that_breaks_off_is_refused(refused: Callable[[str], str]) -> None:
    assert refused(text()[:-12]).startswith("line 4")


def test_line_number_counts_blank_lines(refused: Callable[[str], str]) -> None:
    assert refused(text(rows=("", ROWS[0], "", "x,1,1,1,1"))).startswith("line 5, column time_s")


def test_file_without_samples_is_refused(refused: Callable[[str], str]) -> None:
    assert refused(HEADER + "\n") == "0 samples; at least 2 are needed"


def test_file_with_one_sample_is_refused(refused: Callable[[str], str]) -> None:
    assert refused(text(rows=ROWS[:1])) == "1 samples; at least 2 are needed"


@pytest.mark.parametrize("content", ["", "no table\n", "a;b;c\n1;2;3\n"])
def test_file_in_no_known_format_is_refused(refused: Callable[[str], str], content: str) -> None:
    assert refused(content).startswith("not a log in a known format; known: ")


def test_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"ghost\.csv: no such file"):
        logs.read(tmp_path / "ghost.csv")


def test_text_that_is_not_utf8_is_refused_with_its_byte(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes(text().encode() + b"\xff\xfe")
    with pytest.raises(LogError, match=rf"run.csv: byte {len(text())}: not UTF-8"):
        logs.read(path)


@pytest.mark.parametrize("damage", [lambda b: b[:-20], lambda b: b[:15] + b"\x00" * 8 + b[23:]])
def test_damaged_gzip_file_is_refused(tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    path = tmp_path / "run.csv.gz"
    path.write_bytes(damage(gzip.compress(text().encode())))
    with pytest.raises(LogError, match=r"run\.csv\.gz: damaged gzip file"):
        logs.read(path)


# --- writing ----------------------------------------------------------------------------------


def finite(size: float) -> st.SearchStrategy[float]:
    return st.floats(-size, size)


@settings(
    max_examples=40,
    deadline=None,  # the first file of a form loads its package
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(data=st.data(), count=st.integers(2, 6))
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_is_written_is_read_again(
    tmp_path: Path, suffix: str, data: st.DataObject, count: int
) -> None:
    steps = data.draw(st.lists(st.floats(1e-3, 9.9), min_size=count, max_size=count))
    signals = {
        signal: np.array(data.draw(st.lists(finite(500.0), min_size=count, max_size=count)))
        for _, signal, needed in KNOWN[1:]
        if needed or data.draw(st.booleans())
    }
    log = Log(np.cumsum(steps), signals)
    path = tmp_path / f"run{suffix}"
    logs.write(log, path)
    found = logs.read(path)
    assert set(found.signals) == set(signals)
    digits = {column.signal: column.decimals for column in LOG_COLUMNS.values()}
    assert np.abs(found.time - log.time).max() <= 0.51e-4
    for signal, values in signals.items():
        resolution = 10.0 ** -digits[signal]
        assert np.abs(found[signal] - values).max() <= 0.51 * resolution, signal


@pytest.mark.parametrize("suffix", [s for s in SUFFIXES if s != ".mf4"])  # it holds its date
def test_written_file_written_again_is_the_same_file(tmp_path: Path, suffix: str) -> None:
    first, second = tmp_path / f"first{suffix}", tmp_path / f"second{suffix}"
    random = np.random.default_rng(1)
    signals = {signal: random.normal(size=9) for _, signal, _ in KNOWN[1:]}
    logs.write(Log(0.01 * np.arange(9), signals), first)
    logs.write(logs.read(first), second)
    assert first.read_bytes() == second.read_bytes()


def test_independent_log_is_written_as_it_was_read(
    tmp_path: Path, bench_log: Callable[[str], Log]
) -> None:
    log = bench_log("bench_nominal/program6")
    logs.write(log, tmp_path / "again.csv")
    again = logs.read(tmp_path / "again.csv")
    for name in log.signals:
        np.testing.assert_array_equal(again[name], log[name])


def test_negative_zero_is_written_as_zero(tmp_path: Path) -> None:
    signals = {signal: np.array([-0.0, -0.0]) for _, signal, needed in KNOWN[1:] if needed}
    logs.write(Log(np.array([0.0, 1.0]), signals), tmp_path / "run.csv")
    assert "-0" not in (tmp_path / "run.csv").read_text()


def test_name_of_no_known_format_is_refused(tmp_path: Path) -> None:
    log = Log(np.array([0.0, 1.0]), {})
    with pytest.raises(LogError, match=r"run\.xlsx: no log format of that name; known: \.csv"):
        logs.write(log, tmp_path / "run.xlsx")
