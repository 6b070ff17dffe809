"""An export holds what a recording holds: new samples for analyses, or every tick."""

import csv
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from pyarrow import parquet

import register_maps
from gateway.cli import main
from gateway.configuration.config import Config
from gateway.cycle.record import NOTHING, Layout, Tick
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from gateway.recordings import log, recording
from gateway.recordings.header import Header
from register_maps.signals import Measurement, Status

MAP = register_maps.load("bench_int16")
STANDING = Status.READY


def tick(number: int, sample: int | None, status: Status) -> Tick:
    """A tick that read this sample of the PLC; None: it read nothing."""
    measured = None
    if sample is not None:
        measured = Measurement(
            sequence_start=sample, sequence_end=sample, plc_heartbeat=sample,
            plc_time=0.01 * sample, status=status, motor_speed=0.5 * sample,
            drum_speed=0.008 * sample, shaft_torque=-2.0, speed_reference=2.0 * sample,
        )  # fmt: skip
    return Tick(
        tick=number, now=100.0 + 0.01 * number, period=0.01, lateness=0.0, latency=0.001, age=0.0,
        demand=None, missed=0, overruns=0, dropped=0,
        fault=NOTHING if measured is not None else Reason.TIMEOUT,
        reason=NOTHING, state=State.RUN, shadow=False, stop_requested=False, written=False,
        words_read=None if measured is None else [0] * MAP.measurement.count, words_written=None,
        measurement=measured, setpoint=None,
    )  # fmt: skip


def recorded(path: Path, samples: list[int | None], status: Status = STANDING) -> Path:
    layout, began = Layout.of(MAP), 100.0
    head = Header.of(Config(), MAP, started=began, shadow=False, real_time="no")
    rows = (layout.pack(tick(k, sample, status)) for k, sample in enumerate(samples))
    path.write_bytes(head.encode() + b"".join(rows))
    return path


def export(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["export", *(str(one) for one in arguments)])


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


SAMPLES = [0, 1, 1, 2, None, None, 5, 6, 8, 9]


def test_a_log_has_each_new_sample_once_and_tells_how_well_it_was_polled(tmp_path: Path) -> None:
    """Ten ticks: one read sample 1 again, two failed; samples 3, 4 and 7 were never seen."""
    result = export(recorded(tmp_path / "a.rlrec", SAMPLES), "--to", tmp_path / "a.csv")
    assert "7 samples of 10 ticks" in result.output
    assert "10 ms 66.7 %, 30 ms 16.7 %, 20 ms 16.7 %; 1 samples repeated, 3 skipped" in (
        result.output
    )
    found = log.read(tmp_path / "a.csv")
    assert found.time == pytest.approx([0.0, 0.01, 0.02, 0.05, 0.06, 0.08, 0.09])


def test_reference_is_where_the_plc_said_that_it_would_be(tmp_path: Path) -> None:
    """Sample k says 2 k rad/s for 10 ms later: a line that each sample meets 10 ms late."""
    export(recorded(tmp_path / "a.rlrec", SAMPLES), "--to", tmp_path / "a.csv")
    found = log.read(tmp_path / "a.csv")
    expected = np.maximum(0.0, 2.0 * (found.time / 0.01 - 1.0))
    assert found.columns["speed_reference"][[0, 1, 2, 4, 6]] == pytest.approx(
        expected[[0, 1, 2, 4, 6]], abs=0.2
    )
    # Between the samples 2 and 5 nothing is known: from 4 rad/s at 30 ms straight to 10 at 60 ms.
    assert found.columns["speed_reference"][3] == pytest.approx(8.0, abs=0.2)


def test_every_tick_is_there_with_its_error(tmp_path: Path) -> None:
    result = export(recorded(tmp_path / "a.rlrec", SAMPLES), "--to", tmp_path / "a.csv", "--all")
    assert "10 samples of 10 ticks" in result.output
    found = rows(tmp_path / "a.csv")
    assert [row["tick_error"] for row in found] == [
        "TIMEOUT" if sample is None else "" for sample in SAMPLES
    ]
    assert [float(row["time_s"]) for row in found] == pytest.approx(0.01 * np.arange(10))
    assert (found[4]["motor_speed_rad_s"], found[6]["motor_speed_rad_s"]) == ("", "2.5")


def test_from_and_to_time_cut_the_log_and_keep_its_time(tmp_path: Path) -> None:
    path = recorded(tmp_path / "a.rlrec", list(range(100)))
    result = export(path, "--to", tmp_path / "a.csv", "--from", 0.2, "--to-time", 0.5)
    assert "31 samples of 100 ticks" in result.output
    times = log.read(tmp_path / "a.csv").time
    assert (times[0], times[-1]) == pytest.approx((0.2, 0.5))


def test_times_in_the_wrong_order_are_refused_in_one_line(tmp_path: Path) -> None:
    path = recorded(tmp_path / "a.rlrec", [0, 1, 2])
    result = export(path, "--to", tmp_path / "a.csv", "--from", 5, "--to-time", 3)
    assert result.exit_code == 2
    assert "--from before --to-time" in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize(("status", "marked"), [(Status.ROAD_LOAD, True), (STANDING, False)])
def test_a_truck_on_the_drum_is_marked(tmp_path: Path, status: Status, marked: bool) -> None:
    path = recorded(tmp_path / "a.rlrec", [0, 1, 2], status)
    export(path, "--to", tmp_path / "a.csv")
    assert ("truck_on_drum" in log.read(tmp_path / "a.csv").columns) is marked


def test_poll_quality_stands_in_the_metadata_of_parquet(tmp_path: Path) -> None:
    export(recorded(tmp_path / "a.rlrec", SAMPLES), "--to", tmp_path / "a.parquet")
    found = parquet.read_schema(tmp_path / "a.parquet").metadata
    assert (found[b"repeated samples"], found[b"skipped samples"]) == (b"1", b"3")


def test_a_recording_is_exported_piece_by_piece(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The pieces give the file of a whole reading, and take a third of its memory at most."""
    path = recorded(tmp_path / "a.rlrec", list(range(1500)))
    whole = peak_memory(lambda: export(path, "--to", tmp_path / "whole.csv"))
    monkeypatch.setattr(recording, "PIECE", 50)
    pieces = peak_memory(lambda: export(path, "--to", tmp_path / "pieces.csv"))
    assert (tmp_path / "pieces.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    assert pieces < whole / 3.0


def peak_memory(call: Callable[[], object]) -> int:
    """Largest memory that a call allocates [bytes]."""
    tracemalloc.start()
    call()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak


def test_a_cut_recording_is_streamed_as_it_is_read(tmp_path: Path) -> None:
    path = recorded(tmp_path / "a.rlrec", list(range(10)))
    content = path.read_bytes()
    for rest in (b"", b"\0" * 100_000, content[-20:], b"\0" * 7):
        path.write_bytes(content[:-30] + rest)
        whole, found = recording.read(path), recording.stream(path)
        assert len(found) == len(whole)
        assert found.note == whole.note
        assert b"".join(piece.tobytes() for piece in found.chunks()) == whole.records.tobytes()


def test_a_damaged_record_is_refused_while_streaming(tmp_path: Path) -> None:
    path = recorded(tmp_path / "a.rlrec", list(range(10)))
    content = bytearray(path.read_bytes())
    content[-3 * Layout.of(MAP).size + 40] ^= 1
    path.write_bytes(bytes(content))
    result = export(path, "--to", tmp_path / "a.csv")
    assert result.exit_code == 1
    assert "1 of 10 records damaged" in result.stderr
    assert "tick 7" in result.stderr
