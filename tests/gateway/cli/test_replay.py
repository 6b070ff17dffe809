"""`gateway replay` and `gateway export`: exit codes, machine's answer, figures, files."""

import csv
import gzip
import json
import sys
import zlib
from datetime import datetime
from pathlib import Path
from typing import Any

import asammdf
import numpy as np
import pytest
from click.testing import CliRunner, Result
from pyarrow import parquet

import register_maps
from gateway.cli import main
from gateway.cli.export import command as export
from gateway.cli.replay import command as replay
from gateway.configuration.config import Config
from gateway.cycle.cycle import CycleState, Observation, initial, step
from gateway.cycle.record import NOTHING, Layout, Tick
from gateway.cycle.supervisor import State
from gateway.errors import ConfigError
from gateway.recordings import log, recording
from gateway.recordings.header import Header
from register_maps.codec import decode_measurement, encode_measurement, encode_setpoint
from register_maps.signals import Alarm, Interlock, Measurement, PlcState, Status

MAP = register_maps.load("bench_int16")
STANDING = Status.READY | Status.WARM | Status.WATCHDOG_OK | Status.EMERGENCY_STOP_OK


def measurement(number: int, state: State, echo: int) -> Measurement:
    """A PLC that does as it is told, its bench turning faster and faster."""
    running = state in (State.RUN, State.RAMPDOWN)
    status = STANDING | (Status.REMOTE if number > 20 else 0)
    speed = max(0, number - 55) * 0.05
    # 0.128 kg m^2 times 313 rad/s^2 are 40.06 N m
    flux = min(1.8506, 366.83 / (8.0644 + 62.6 * speed))
    current = (2.0 + (40.06 if number > 55 else 0.0)) / flux
    return Measurement(
        sequence_start=number,
        sequence_end=number,
        plc_heartbeat=number,
        plc_time=0.01 * number,
        status=status | (Status.ENABLED | Status.ROAD_LOAD if running else 0),
        plc_state=PlcState.ROAD_LOAD if running else PlcState.READY,
        alarm=Alarm(0),
        alarm_reserved=0,
        interlock=Interlock(sum(Interlock)),
        motor_speed=62.6 * speed,
        drum_speed=speed,
        shaft_torque=-2.0 - 0.01 * (number % 2),
        shaft_torque_mean=-2.0,
        shaft_torque_integral=-0.02 * number,
        armature_current=current,
        armature_voltage=10.0,
        speed_reference=62.6 * speed,
        shell_temperature_1=305.15,
        shell_temperature_2=305.15,
        field_current=0.0,
        drum_count=0,
        motor_count=0,
        command_sequence_echo=echo,
        command_age=0.01 if echo else 60.0,
        scan_time_max=0.001,
        test_int16=-12345,
        test_uint32=0x12345678,
    )


def recorded(path: Path, ticks: int = 120) -> Path:
    """A recording of so many ticks, made by the tick itself."""
    # this bench follows no setpoint: limits that let it
    wide = {"limits.deviation_rpm": 4830.0, "limits.rate_up_rpm_s": 30000.0}
    config, layout = Config().with_values(wide), Layout.of(MAP)
    content = Header.of(config, MAP, started=0.0, shadow=False, real_time="no").encode()
    state: CycleState = initial(config, MAP)
    mode, echo = State.OFF, 0
    for number in range(ticks):
        words = encode_measurement(MAP, measurement(number, mode, echo))
        seen = Observation(
            now=0.01 * number, measurement=decode_measurement(MAP, words), shadow=False
        )
        state, output = step(config, MAP, state, seen)
        mode = output.state
        echo = output.setpoint.command_sequence if output.setpoint else echo
        made: dict[str, Any] = {
            "tick": number,
            "now": seen.now,
            "period": 0.01,
            "lateness": 0.0,
            "latency": 0.001 * (number % 4),
            "age": output.age,
            "demand": output.demand,
            "missed": 3,
            "overruns": 0,
            "dropped": 0,
            "fault": NOTHING,
            "reason": output.reason or NOTHING,
            "state": output.state,
            "shadow": False,
            "stop_requested": False,
            "written": output.setpoint is not None,
            "words_read": words,
            "words_written": output.setpoint and encode_setpoint(MAP, output.setpoint),
            "measurement": seen.measurement,
            "setpoint": output.setpoint,
        }
        content += layout.pack(Tick(**made))
    assert mode is State.RUN
    path.write_bytes(content)
    return path


def call(command: Any, *arguments: object) -> Result:
    return CliRunner().invoke(
        command, [str(one) for one in arguments], standalone_mode=False, catch_exceptions=False
    )


def test_a_recording_comes_out_bit_for_bit(tmp_path: Path) -> None:
    result = call(replay, recorded(tmp_path / "a.rlrec"))
    assert result.return_value == 0
    assert "120 ticks, equal bit for bit" in result.output


def test_a_changed_recording_does_not_and_the_place_is_named(tmp_path: Path) -> None:
    path = recorded(tmp_path / "a.rlrec")
    found = recording.read(path)
    content = bytearray(path.read_bytes())
    place = found.records.dtype.fields["demand"][1]  # type: ignore[index]
    start = len(content) - len(found.records) * found.header.layout.size
    begin = start + 60 * found.header.layout.size
    end = begin + found.header.layout.size
    content[begin + place] ^= 1  # the last bit of tick 60's demand
    content[end - 4 : end] = zlib.crc32(content[begin : end - 4]).to_bytes(4, "little")
    path.write_bytes(content)
    result = call(replay, path)
    assert result.return_value == 1
    assert "1 of 120 ticks differ, the first is tick 60 at 0.600 s: demand" in result.output


@pytest.mark.parametrize("command", ["replay", "export"])
def test_a_damaged_recording_is_one_line_and_code_1(tmp_path: Path, command: str) -> None:
    path = recorded(tmp_path / "a.rlrec")
    content = bytearray(path.read_bytes())
    content[-1 - 60 * recording.read(path).header.layout.size] ^= 1  # the checksum of tick 59
    path.write_bytes(content)
    target = ["--to", str(tmp_path / "a.csv")] if command == "export" else []
    result = CliRunner().invoke(main, [command, str(path), *target])
    assert result.exit_code == 1
    assert result.output.count("\n") == 1
    assert "a.rlrec: tick 59: checksum differs, 1 of 120 records damaged" in result.output
    assert not (tmp_path / "a.csv").exists()


@pytest.mark.parametrize("command", ["replay", "export"])
def test_a_torn_last_record_is_told_and_the_rest_is_used(tmp_path: Path, command: str) -> None:
    path = recorded(tmp_path / "a.rlrec")
    path.write_bytes(path.read_bytes()[:-7])
    target = ["--to", str(tmp_path / "a.csv")] if command == "export" else []
    result = CliRunner().invoke(main, [command, str(path), *target])
    assert result.exit_code == 0
    assert "119 ticks" in result.output
    assert "of an unfinished last record left out" in result.output


def test_other_parameters_show_the_difference_and_are_no_failure(tmp_path: Path) -> None:
    path, out, plot = recorded(tmp_path / "a.rlrec"), tmp_path / "a.csv", tmp_path / "a.png"
    result = call(replay, path, "--set", "truck.load_kg=1600", "--out", out, "--plot", plot)
    assert result.return_value == 0
    assert "ticks differ" in result.output
    assert "difference rms" in result.output
    with out.open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 120
    assert rows[-1]["state"] == "RUN"
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_the_answer_for_a_machine_is_a_run(tmp_path: Path) -> None:
    answer = json.loads(call(replay, recorded(tmp_path / "a.rlrec"), "--json", "-").output)
    assert answer["schema"] == "run/1"
    assert (answer["truck_kg"], answer["cycles"], answer["missed_deadlines"]) == (3640, 120, 3)
    assert answer["latency_ms"] == pytest.approx({"p50": 1.5, "p99": 3.0, "max": 3.0})
    assert answer["velocity"] == {"val1": 100.0, "val2": 100.0}


def test_export_writes_a_log_with_the_recorded_numbers(tmp_path: Path) -> None:
    path, target = recorded(tmp_path / "a.rlrec"), tmp_path / "a.csv.gz"
    assert "120 samples of 120 ticks" in call(export, path, "--to", target).output
    exported = log.read(target)
    assert exported.time == pytest.approx(np.arange(120) * 0.01)
    wanted = recording.read(path).records["measured_motor_speed"]
    assert exported.columns["motor_speed"].tolist() == wanted.tolist()
    assert exported.columns["shell_temperature"] == pytest.approx(305.15)
    with gzip.open(target, "rt") as file:
        last = list(csv.DictReader(file))[-1]
    assert (last["state"], last["reason"], last["written"]) == ("RUN", "", "1")


@pytest.mark.parametrize("suffix", [".parquet", ".mf4"])
def test_export_in_other_forms_holds_the_same_numbers_as_csv(tmp_path: Path, suffix: str) -> None:
    path = recorded(tmp_path / "a.rlrec")
    for target in (tmp_path / "a.csv", tmp_path / f"a{suffix}"):
        assert "120 samples of 120 ticks" in call(export, path, "--to", target).output
    wanted, found = log.read(tmp_path / "a.csv"), log.read(tmp_path / f"a{suffix}")
    assert found.time.tolist() == wanted.time.tolist()
    assert found.columns.keys() == wanted.columns.keys()
    for name, values in wanted.columns.items():
        assert found.columns[name].tolist() == values.tolist(), name


def test_exported_parquet_holds_units_and_the_gateways_own_columns(tmp_path: Path) -> None:
    target = tmp_path / "a.parquet"
    call(export, recorded(tmp_path / "a.rlrec"), "--to", target)
    table = parquet.read_table(target)
    units = {field.name: field.metadata[b"unit"].decode() for field in table.schema}
    assert units["motor_speed"] == units["demand_motor_speed"] == "rad/s"
    assert (units["time"], units["shaft_torque"], units["tick"]) == ("s", "N m", "1")
    assert units["shell_temperature"] == "degC"
    assert table["state"][-1].as_py() == "RUN"
    assert table["written"][-1].as_py() is True
    assert table["shell_temperature"][0].as_py() == pytest.approx(32.0)


def test_exported_mdf4_holds_units_texts_and_the_date_of_its_first_sample(tmp_path: Path) -> None:
    path, target = recorded(tmp_path / "a.rlrec"), tmp_path / "a.mf4"
    call(export, path, "--to", target)
    with asammdf.MDF(target) as file:
        began = file.start_time
        torque, state = file.get("shaft_torque"), file.get("state")
    assert torque.unit == "N m"
    assert torque.timestamps == pytest.approx(np.arange(120) * 0.01)
    assert state.samples[-1] == b"RUN"
    found = recording.read(path)
    waited = float(found.records["now"][0]) - found.header.started
    assert (began - datetime.fromisoformat(found.header.date)).total_seconds() == pytest.approx(
        waited, abs=1e-3
    )


@pytest.mark.parametrize("suffix", [".parquet", ".mf4"])
def test_an_exported_recording_replays_like_its_csv(tmp_path: Path, suffix: str) -> None:
    path, answers = recorded(tmp_path / "a.rlrec"), []
    for target in (tmp_path / "a.csv", tmp_path / f"a{suffix}"):
        call(export, path, "--to", target)
        answers.append(json.loads(call(replay, target, "--json", "-").output))
    assert answers[0] == answers[1]


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mf4"])
def test_a_recording_without_a_sample_is_exported_empty(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / "a.rlrec"
    path.write_bytes(Header.of(Config(), MAP, started=0.0, shadow=False, real_time="no").encode())
    assert "0 samples of 0 ticks" in call(export, path, "--to", tmp_path / f"a{suffix}").output
    with pytest.raises(log.LogError, match="0 samples; at least 2"):
        log.read(tmp_path / f"a{suffix}")


def test_export_without_the_package_names_the_extra_and_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    path = recorded(tmp_path / "a.rlrec")
    result = CliRunner().invoke(main, ["export", str(path), "--to", str(tmp_path / "a.parquet")])
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    assert "pip install 'road-load-bench[parquet]'" in result.stderr
    assert not (tmp_path / "a.parquet").exists()


def test_export_of_an_unknown_form_names_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(Exception, match=r"expected one of \.csv") as caught:
        call(export, recorded(tmp_path / "a.rlrec"), "--to", tmp_path / "a.xls")
    assert caught.value.exit_code == 2  # type: ignore[attr-defined]


def test_a_log_that_stands_asks_for_no_speed(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    head = "time_s,speed_reference_rad_s,motor_speed_rad_s,drum_speed_rad_s,shaft_torque_Nm\n"
    path.write_text(head + "".join(f"{0.01 * k:.2f},0,0,0,0\n" for k in range(200)))
    result = call(replay, path)
    assert result.return_value == 0
    assert "not in the log: armature_current_A" in result.output
    assert "difference rms 0.000 rpm" in result.output


def test_the_same_log_through_a_heavier_truck_goes_slower(tmp_path: Path) -> None:
    """A truck pushes for a second: the emulated speed gain is in inverse proportion to mass."""
    path = tmp_path / "log.csv"
    head = "time_s,speed_reference_rad_s,motor_speed_rad_s,drum_speed_rad_s,shaft_torque_Nm\n"
    rows = [
        (0.01 * k, 0.0, 1e-3 * k, 1e-3 * k / 62.6, 20.0 if 50 <= k < 150 else -1.5)
        for k in range(200)
    ]
    path.write_text(head + "".join(",".join(f"{v:.6f}" for v in row) + "\n" for row in rows))
    reached = []
    for load in (0, 3640):
        out = tmp_path / f"{load}.csv"
        call(replay, path, "--set", f"truck.load_kg={load}", "--out", out)
        with out.open() as file:
            reached.append(max(float(r["demand_motor_speed_rad_s"]) for r in csv.DictReader(file)))
    assert reached[0] > 1.2 * reached[1] > 0.0


def test_a_file_that_is_not_there_is_bad_input(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"none\.rlrec"):
        call(replay, tmp_path / "none.rlrec")
