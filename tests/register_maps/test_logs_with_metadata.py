"""Parquet and MDF4 logs: files of other programs are read, by daemon and physics alike, or refused.

The files are written here with pandas, pyarrow and asammdf, as their users do, not by our writers.
"""

import io
import sys
from pathlib import Path
from typing import Any

import asammdf
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from gateway.recordings import log as gateway_log
from plant_emulator import logs as emulator_logs
from plant_emulator.errors import LogError

# name, unit, values
Channel = tuple[str, str, Any]
TIME: Channel = ("time", "s", [0.0, 0.01, 0.02])
LOG: tuple[Channel, ...] = (
    ("speed_reference", "rad/s", [1.0, 1.5, 2.0]),
    ("motor_speed", "rad/s", [2.0, 2.5, 3.0]),
    ("drum_speed", "rad/s", [0.03, 0.04, 0.05]),
    ("shaft_torque", "N m", [-4.0, -5.0, -6.0]),
    ("shell_temperature", "degC", [32.0, 32.5, -273.15]),
)


def parquet(path: Path, *channels: Channel) -> Path:
    arrays = [pa.array(values) for _, _, values in channels]
    fields = [
        pa.field(name, array.type, metadata={"unit": unit} if unit else None)
        for (name, unit, _), array in zip(channels, arrays, strict=True)
    ]
    pq.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields)), path)
    return path


def signals(*channels: Channel, time: Any = TIME[2]) -> list[asammdf.Signal]:
    return [
        asammdf.Signal(
            np.asarray(values), np.asarray(time, float), name=name, unit=unit, encoding="utf-8"
        )
        for name, unit, values in channels
    ]


def mdf4(path: Path, *groups: list[asammdf.Signal]) -> Path:
    with asammdf.MDF(version="4.10") as file:
        for group in groups:
            file.append(group)
        file.save(path)
    return path


def write(path: Path, *channels: Channel) -> Path:
    """A file of either form; in MDF4 the channel `time` is the master."""
    if path.suffix == ".parquet":
        return parquet(path, *channels)
    [time] = [values for name, _, values in channels if name == "time"]
    return mdf4(path, signals(*(c for c in channels if c[0] != "time"), time=time))


def changed(name: str, values: Any = None, unit: str | None = None) -> list[Channel]:
    """The log with other values or another unit in one column."""
    return [
        (n, u if n != name or unit is None else unit, v if n != name or values is None else values)
        for n, u, v in (TIME, *LOG)
    ]


def read_by_both(path: Path) -> dict[str, list[float]]:
    daemon, physics = gateway_log.read(path), emulator_logs.read(path)
    assert daemon.columns.keys() == physics.signals.keys()
    assert daemon.time.tolist() == physics.time.tolist()
    for signal, values in daemon.columns.items():
        np.testing.assert_array_equal(physics[signal], values)
    return {"time": daemon.time.tolist()} | {k: v.tolist() for k, v in daemon.columns.items()}


def refused_by_both(path: Path) -> str:
    with pytest.raises(gateway_log.LogError) as daemon:
        gateway_log.read(path)
    with pytest.raises(LogError) as physics:
        emulator_logs.read(path)
    assert daemon.value.exit_code == physics.value.exit_code == 2
    assert str(daemon.value) == str(physics.value)
    assert str(physics.value).startswith(f"{path}: ")
    assert "\n" not in str(physics.value)
    return str(physics.value).removeprefix(f"{path}: ")


def assert_is_the_log(found: dict[str, list[float]], digits: float = 1e-12) -> None:
    assert found["time"] == pytest.approx(TIME[2], rel=digits)
    for name, _, values in LOG[:4]:
        assert found[name] == pytest.approx(values, rel=digits), name
    assert found["shell_temperature"] == pytest.approx([305.15, 305.65, 0.0], abs=1e-4)


@pytest.fixture(params=[".parquet", ".mf4"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return tmp_path / f"run{request.param}"


# --- files of other programs --------------------------------------------------------------------


def test_values_are_read_in_si(path: Path) -> None:
    assert_is_the_log(read_by_both(write(path, TIME, *LOG)))


def test_columns_may_stand_in_any_order(path: Path) -> None:
    assert_is_the_log(read_by_both(write(path, *reversed(LOG), TIME)))


def test_format_is_known_by_content_not_by_name(path: Path) -> None:
    other = write(path, TIME, *LOG).rename(path.with_name("run.csv"))
    assert_is_the_log(read_by_both(other))


def test_single_precision_and_integers_are_read(path: Path) -> None:
    single = [(name, unit, np.array(values, "f4")) for name, unit, values in (TIME, *LOG[1:])]
    whole: Channel = ("speed_reference", "rad/s", np.array([1, 2, 3], "i2"))
    found = read_by_both(write(path, whole, *single))
    assert found["speed_reference"] == [1.0, 2.0, 3.0]
    assert_is_the_log(found | {"speed_reference": [1.0, 1.5, 2.0]}, digits=1e-6)


@pytest.mark.parametrize(
    ("name", "unit"),
    [("shaft_torque", "Nm"), ("shaft_torque", "N·m"), ("shell_temperature", "°C")],
)
def test_other_spellings_of_a_unit_are_the_same_unit(path: Path, name: str, unit: str) -> None:
    assert_is_the_log(read_by_both(write(path, *changed(name, unit=unit))))


def test_unknown_columns_are_named_and_left_alone(path: Path) -> None:
    extra: list[Channel] = [
        ("oil_level", "m", [0.1, np.nan, 0.2]),
        ("phase", "", np.array([b"a", b"b", b"c"])),
        ("motor_speed", "rpm", [19.1, 23.9, 28.6]),
    ]
    write(path, *extra, TIME, *LOG)
    assert emulator_logs.read(path).other == ("oil_level [m]", "phase", "motor_speed [rpm]")
    assert_is_the_log(read_by_both(path))


def frame() -> pd.DataFrame:
    """The log as pandas reads it from CSV."""
    text = "time_s,drum_speed_rad_s,shaft_torque_Nm,note,speed_reference_rad_s,motor_speed_rad_s\n"
    rows = "0,0.03,-4,a,1,2\n0.01,0.04,-5,b,1.5,2.5\n0.02,0.05,-6,c,2,3\n"
    return pd.read_csv(io.StringIO(text + rows))


@pytest.mark.parametrize("index", [None, "time_s"])
def test_csv_that_pandas_made_a_parquet_of_is_read(tmp_path: Path, index: str | None) -> None:
    table = frame() if index is None else frame().set_index(index)
    table.to_parquet(tmp_path / "run.parquet")
    found = read_by_both(tmp_path / "run.parquet")
    assert found["time"] == [0.0, 0.01, 0.02]
    assert found["shaft_torque"] == [-4.0, -5.0, -6.0]
    assert emulator_logs.read(tmp_path / "run.parquet").other == ("note",)


def test_csv_that_asammdf_made_an_mdf4_of_is_read(tmp_path: Path) -> None:
    with asammdf.MDF(version="4.11") as file:
        file.append(frame().set_index("time_s").drop(columns="note"))
        file.save(tmp_path / "run.mf4", compression=2)
    assert read_by_both(tmp_path / "run.mf4")["motor_speed"] == [2.0, 2.5, 3.0]


def test_each_channel_may_stand_in_a_group_of_its_own(tmp_path: Path) -> None:
    path = mdf4(tmp_path / "run.mf4", *([one] for one in reversed(signals(*LOG))))
    assert_is_the_log(read_by_both(path))


def test_other_groups_may_have_other_times(tmp_path: Path) -> None:
    slow = signals(("oil_level", "m", [0.1]), time=[0.5])
    assert_is_the_log(read_by_both(mdf4(tmp_path / "run.mf4", slow, signals(*LOG))))


def test_channel_stored_as_counts_is_read_as_what_they_mean(tmp_path: Path) -> None:
    """Speed = 0.5 rad/s a count + 1 rad/s, as data acquisition stores it."""
    counts = asammdf.Signal(
        np.array([2, 3, 4], "i2"),
        np.array(TIME[2]),
        name="motor_speed",
        unit="rad/s",
        conversion={"a": 0.5, "b": 1.0},
    )
    path = mdf4(tmp_path / "run.mf4", [counts, *signals(LOG[0], *LOG[2:])])
    assert read_by_both(path)["motor_speed"] == [2.0, 2.5, 3.0]


# --- refusals -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "unit", "says"),
    [
        ("motor_speed", "rpm", "column motor_speed [rpm]; expected motor_speed [rad/s]"),
        ("shaft_torque", "kNm", "column shaft_torque [kNm]; expected shaft_torque [N m]"),
        (
            "shell_temperature",
            "K",
            "column shell_temperature [K]; expected shell_temperature [degC]",
        ),
        ("drum_speed", "", "column drum_speed; expected drum_speed [rad/s]"),
    ],
)
def test_wrong_unit_is_refused(path: Path, name: str, unit: str, says: str) -> None:
    assert refused_by_both(write(path, *changed(name, unit=unit))) == says


def test_unit_in_the_name_is_no_excuse_for_another_in_the_metadata(path: Path) -> None:
    wrong: Channel = ("motor_speed_rad_s", "rpm", [19.1, 23.9, 28.6])
    says = refused_by_both(write(path, TIME, wrong, LOG[0], *LOG[2:]))
    assert says == "column motor_speed [rpm]; expected motor_speed [rad/s]"


def test_wrong_unit_in_the_name_is_refused(path: Path) -> None:
    wrong: Channel = ("motor_speed_rpm", "", [19.1, 23.9, 28.6])
    says = refused_by_both(write(path, TIME, wrong, LOG[0], *LOG[2:]))
    assert says == "column motor_speed_rpm; expected motor_speed [rad/s]"


def test_time_in_milliseconds_is_refused(tmp_path: Path) -> None:
    path = parquet(tmp_path / "run.parquet", *changed("time", [0.0, 10.0, 20.0], "ms"))
    assert refused_by_both(path) == "column time [ms]; expected time [s]"


@pytest.mark.parametrize("missing", range(4))
def test_missing_needed_column_is_refused(path: Path, missing: int) -> None:
    left = [channel for k, channel in enumerate(LOG) if k != missing]
    name, unit, _ = LOG[missing]
    says = refused_by_both(write(path, TIME, *left))
    assert says == f"column {name} [{unit}] is missing; it is needed"


def test_parquet_without_a_time_is_refused(tmp_path: Path) -> None:
    path = parquet(tmp_path / "run.parquet", *LOG)
    assert refused_by_both(path) == "column time [s] is missing; it is needed"


def test_column_that_stands_twice_is_refused(path: Path) -> None:
    again: Channel = ("drum_speed_rad_s", "", [0.03, 0.04, 0.05])
    says = refused_by_both(write(path, TIME, *LOG, again))
    assert says == "column drum_speed [rad/s] stands twice"


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_value_that_is_not_finite_is_refused(path: Path, value: float) -> None:
    says = refused_by_both(write(path, *changed("shaft_torque", [-4.0, -5.0, value])))
    assert says == f"row 3, column shaft_torque [N m]: {value}; expected a finite number"


def test_value_that_is_not_there_is_refused(tmp_path: Path) -> None:
    path = parquet(tmp_path / "run.parquet", *changed("motor_speed", [2.0, None, 3.0]))
    says = refused_by_both(path)
    assert says == "row 2, column motor_speed [rad/s]: nan; expected a finite number"


def test_value_that_is_called_invalid_is_refused(tmp_path: Path) -> None:
    channels = signals(*LOG)
    channels[1].invalidation_bits = asammdf.InvalidationArray([False, True, False])
    says = refused_by_both(mdf4(tmp_path / "run.mf4", channels))
    assert says == "row 2, column motor_speed [rad/s]: nan; expected a finite number"


@pytest.mark.parametrize("time", [0.01, 0.005, -1.0])
def test_time_that_does_not_increase_is_refused(path: Path, time: float) -> None:
    says = refused_by_both(write(path, *changed("time", [0.0, 0.01, time])))
    assert says == f"row 3, column time [s]: {time} after 0.01; time must increase strictly"


def test_file_with_one_sample_is_refused(path: Path) -> None:
    one = [(name, unit, values[:1]) for name, unit, values in (TIME, *LOG)]
    assert refused_by_both(write(path, *one)) == "1 samples; at least 2 are needed"


def test_column_of_texts_is_refused(path: Path) -> None:
    texts = np.array([b"1", b"2", b"3"])
    says = refused_by_both(write(path, *changed("motor_speed", texts)))
    assert says.startswith("column motor_speed")
    assert says.endswith("; expected numbers")


def test_groups_with_different_times_are_refused(tmp_path: Path) -> None:
    later = signals(LOG[3], time=[0.0, 0.011, 0.02])
    shorter = signals(("shaft_torque", "N m", [-4.0, -5.0]), time=[0.0, 0.01])
    for k, group in enumerate((later, shorter)):
        says = refused_by_both(mdf4(tmp_path / f"{k}.mf4", signals(*LOG[:3]), group))
        assert says == (
            "column shaft_torque [N m]: was not sampled at the times of drum_speed [rad/s]; "
            "expected one time for all"
        )


def test_group_whose_master_is_an_angle_is_refused(tmp_path: Path) -> None:
    channels = signals(*LOG)
    for channel in channels:
        channel.master_metadata = ("angle", 2)
    says = refused_by_both(mdf4(tmp_path / "run.mf4", channels))
    assert says.endswith("its group has no time; expected a master in seconds")


@pytest.mark.parametrize("part", [0.05, 0.3, 0.6, 0.9, 0.999])
def test_file_that_was_cut_is_refused_without_another_word(
    path: Path, part: float, capfd: pytest.CaptureFixture[str]
) -> None:
    data = write(path, TIME, *LOG).read_bytes()
    path.write_bytes(data[: int(part * len(data))])
    assert refused_by_both(path).startswith("damaged ")
    assert capfd.readouterr() == ("", "")


def test_damaged_file_is_refused_or_read_but_never_an_accident(
    path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    data = write(path, TIME, *LOG).read_bytes()
    random = np.random.default_rng(1)
    refusals = 0
    for _ in range(100):
        damaged = bytearray(data)
        damaged[random.integers(9, len(data))] ^= int(random.integers(1, 256))
        path.write_bytes(damaged)
        try:
            emulator_logs.read(path)
        except LogError as error:
            assert "\n" not in str(error)
            refusals += 1
    assert refusals > 10
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("suffix", "package", "extra"),
    [(".parquet", "pyarrow", "parquet"), (".mf4", "asammdf", "mdf4")],
)
def test_without_its_package_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, package: str, extra: str
) -> None:
    path = write(tmp_path / f"run{suffix}", TIME, *LOG)
    log = emulator_logs.read(path)
    monkeypatch.setitem(sys.modules, package, None)
    assert f"pip install 'road-load-bench[{extra}]'" in refused_by_both(path)
    target = tmp_path / f"again{suffix}"
    with pytest.raises(LogError, match=rf"pip install 'road-load-bench\[{extra}\]'"):
        emulator_logs.write(log, target)
    assert not target.exists()


def test_parquet_that_holds_a_comma_and_a_line_end_is_no_csv() -> None:
    """A page header may hold the bytes of comma and line end: it is no CSV for that."""
    head = b"PAR1\x15\x04\x15,\n"
    [known] = [form.NAME for form in emulator_logs.formats() if form.recognises(head)]
    assert known == "Parquet"
