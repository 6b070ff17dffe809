"""A recording holds every tick, whatever happens to the gateway or to the end of the file."""

import json
import math
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import register_maps
from gateway.configuration.config import Config
from gateway.cycle.record import COMMANDED, MEASURED, NOTHING, Layout, Tick
from gateway.errors import GatewayError, RecordingError
from gateway.recordings.header import Header, config_of
from gateway.recordings.recorder import Job, Recorder, reason_of_end
from gateway.recordings.recording import is_recording, read, stream
from register_maps.signals import Control, Measurement, Mode, Setpoint, Status

LAYOUT = Layout(read_count=3, write_count=2)
HEADER = replace(
    Header.of(
        Config(), register_maps.load("bench_int16"), started=1000.0, shadow=True, real_time="no"
    ),
    read_count=3,
    write_count=2,
    states={"1": "RUN"},
    reasons={"12": ["LATE", ""]},
)

MEASUREMENT = Measurement(
    sequence_start=65535,
    plc_heartbeat=7,
    plc_time=429496.7295,
    status=Status.READY,
    motor_speed=0.1,
    drum_speed=-0.3,
    shaft_torque=-12.8,
    test_uint32=0x12345678,
    sequence_end=65535,
)
SETPOINT = Setpoint(
    command_sequence=9,
    gateway_heartbeat=10,
    control=Control.ENABLE,
    mode=Mode.ROAD_LOAD,
    speed_setpoint=1.0 / 3.0,
)


def tick(index: int, *, read_back: bool = True) -> Tick:
    return Tick(
        tick=index,
        now=1000.0 + 0.01 * index,
        period=0.01,
        lateness=5e-5,
        latency=4e-4,
        age=None,
        demand=0.1 + index,
        missed=0,
        overruns=0,
        dropped=0,
        fault=NOTHING,
        reason=12,
        state=1,
        shadow=True,
        stop_requested=False,
        written=False,
        words_read=(1, 2, 65535) if read_back else None,
        words_written=(3, 4),
        measurement=MEASUREMENT if read_back else None,
        setpoint=SETPOINT,
    )


def write(path: Path, count: int) -> bytes:
    content = HEADER.encode() + b"".join(LAYOUT.pack(tick(index)) for index in range(count))
    path.write_bytes(content)
    return content


def test_what_was_recorded_is_read_bit_for_bit(tmp_path: Path) -> None:
    path = tmp_path / "a.rlrec"
    recorder = Recorder(Job(path=path, header=HEADER))
    for index in range(5):
        recorder.push(LAYOUT.pack(tick(index)))
    recorder.close()
    found = read(path)
    assert (found.header.states, len(found), found.note) == ({"1": "RUN"}, 5, "")
    assert found.records["now"].tolist() == [1000.0 + 0.01 * index for index in range(5)]
    last = found.records[-1]
    assert last["demand"] == 0.1 + 4
    assert math.isnan(last["age"])
    assert last["words_read"].tolist() == [1, 2, 65535]
    assert last["words_written"].tolist() == [3, 4]
    assert last["measured_plc_time"] == 429496.7295
    assert last["measured_test_uint32"] == 0x12345678
    assert math.isnan(last["measured_armature_current"])
    assert last["setpoint_speed_setpoint"] == 1.0 / 3.0
    assert (found.state(last["state"]), found.reason(last["fault"])) == ("RUN", "")
    assert found.reason(last["reason"]) == "LATE"


def test_record_and_numpy_agree_on_the_layout() -> None:
    assert np.dtype(LAYOUT.formats).itemsize == LAYOUT.size == len(LAYOUT.pack(tick(0)))
    assert LAYOUT.size < 4096, "a record goes into the pipe whole only below PIPE_BUF"
    assert len(MEASURED) + len(COMMANDED) == sum(
        name.startswith(("measured_", "setpoint_")) for name, _, _ in LAYOUT.formats
    )


def test_a_file_cut_anywhere_in_its_last_record_keeps_all_before_it(tmp_path: Path) -> None:
    path = tmp_path / "a.rlrec"
    content = write(path, 3)
    for left in range(LAYOUT.size):
        path.write_bytes(content[: len(content) - LAYOUT.size + left])
        found = read(path)
        assert len(found) == 2
        assert (f"{left} bytes" in found.note) == (left > 0)


def test_a_last_record_of_zeros_is_left_out(tmp_path: Path) -> None:
    """What a file system may leave after the power went: the length is there, the bytes are not."""
    path = tmp_path / "a.rlrec"
    content = write(path, 3)
    path.write_bytes(content[: -LAYOUT.size] + bytes(LAYOUT.size))
    assert len(read(path)) == 2


@pytest.mark.parametrize("zeros", [1, 10, 3 * LAYOUT.size])
def test_zeros_after_a_torn_record_are_left_out_with_it(tmp_path: Path, zeros: int) -> None:
    path = tmp_path / "a.rlrec"
    content = write(path, 3)
    path.write_bytes(content[: -LAYOUT.size // 2] + bytes(zeros))
    found = read(path)
    assert len(found) == 2
    assert "of an unfinished last record left out" in found.note


@pytest.mark.parametrize(
    ("damaged", "says"),
    [
        ((0,), "tick 0: checksum differs, 1 of 5 records damaged"),
        ((3,), "tick 3: checksum differs, 1 of 5 records damaged"),
        ((1, 2), "tick 1: checksum differs, 2 of 5 records damaged"),
        ((3, 4), "tick 3: checksum differs, 1 of 4 records damaged"),
    ],
)
def test_a_damaged_record_before_the_last_is_a_failure_that_names_its_tick(
    tmp_path: Path, damaged: tuple[int, ...], says: str
) -> None:
    path = tmp_path / "a.rlrec"
    content = bytearray(write(path, 5))
    start = len(content) - 5 * LAYOUT.size
    for index in damaged:
        content[start + index * LAYOUT.size] ^= 0x40  # also its own number of the tick is wrong
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=says) as caught:
        read(path)
    assert caught.value.exit_code == 1


@pytest.mark.parametrize("length", [0, 4, 11, 40])
def test_a_file_without_a_whole_header_is_refused(tmp_path: Path, length: int) -> None:
    path = tmp_path / "a.rlrec"
    path.write_bytes(write(path, 1)[:length])
    with pytest.raises(RecordingError, match="not a recording") as caught:
        read(path)
    assert caught.value.exit_code == 2


def with_header(content: bytes, change: Callable[[dict[str, Any]], object]) -> bytes:
    """A recording whose header is changed as JSON, without the gateway's own reader and writer."""
    length = int.from_bytes(content[8:12], "little")
    document = json.loads(content[12 : 12 + length])
    text = json.dumps(change(document)).encode()
    return content[:8] + len(text).to_bytes(4, "little") + text + content[12 + length :]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda _: [], r"schema: unknown format, found \[\]; expected 'recording/1'"),
        (lambda head: head | {"schema": "recording/9"}, "schema: unknown format, found 'rec"),
        (lambda head: head | {"map_text": 3}, "map_text: bad header, found 3; expected a value of"),
        (lambda head: head | {"states": None}, "states: bad header, found 'nothing'; expected a"),
        (lambda head: {"schema": head["schema"]}, "title: bad header, found 'nothing'; expected"),
    ],
)
def test_a_bad_header_is_refused_with_its_key(
    tmp_path: Path, change: Callable[[dict[str, Any]], object], says: str
) -> None:
    path = tmp_path / "a.rlrec"
    path.write_bytes(with_header(write(path, 1), change))
    for reading in (read, stream):
        with pytest.raises(RecordingError, match=says) as caught:
            reading(path)
        assert caught.value.exit_code == 2


def test_a_recording_older_than_the_entry_of_its_program_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.rlrec"
    without = {"program"}
    path.write_bytes(
        with_header(write(path, 1), lambda head: {k: head[k] for k in head if k not in without})
    )
    assert read(path).header == HEADER


def test_a_recording_with_the_old_name_of_a_key_has_its_configuration(tmp_path: Path) -> None:
    path = tmp_path / "a.rlrec"

    def older(head: dict[str, Any]) -> dict[str, Any]:
        assert head["config"]["plausibility"].pop("noisy_sensors") is False
        head["config"]["plausibility"]["noisy_speeds"] = True
        return head

    path.write_bytes(with_header(write(path, 1), older))
    assert config_of(read(path).header).plausibility.noisy_sensors


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time_s,motor_speed_rad_s\n0,1\n")
    assert not is_recording(path)
    with pytest.raises(RecordingError, match="not a recording"):
        read(path)


def test_a_directory_that_cannot_be_written_is_refused_at_the_start(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(RecordingError, match="recording"):
        Recorder(Job(path=file / "a.rlrec", header=HEADER))


def test_a_full_pipe_drops_the_record_and_counts_it(tmp_path: Path) -> None:
    recorder = Recorder(Job(path=tmp_path / "a.rlrec", header=HEADER))
    record = LAYOUT.pack(tick(0))
    pushed = 0
    while not recorder.dropped:
        recorder.push(record)
        pushed += 1
    recorder.close()
    assert len(read(tmp_path / "a.rlrec")) == pushed - recorder.dropped


def test_a_full_disk_is_told_in_one_line_and_keeps_every_whole_record(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The limit on a file's size, inherited by the recorder, stands for the disk's end."""
    path, record = tmp_path / "a.rlrec", LAYOUT.pack(tick(0))
    room = len(HEADER.encode()) + 3 * LAYOUT.size + 5
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        recorder = Recorder(Job(path=path, header=HEADER))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    while not recorder.failed:  # what has no room ends the recorder, and its end the pipe
        recorder.push(record)
    with pytest.raises(GatewayError, match="failed: File too large; expected room"):
        recorder.close()
    assert capfd.readouterr() == ("", "")
    found = read(path)
    assert path.stat().st_size == room
    assert (len(found), "5 bytes of an unfinished" in found.note) == (3, True)


GATEWAY_THAT_IS_KILLED = """
import os, signal, sys
from pathlib import Path
from gateway.recordings.recorder import Job, Recorder, reason_of_end
from tests.gateway.recordings.test_recorder import HEADER, LAYOUT, tick
if __name__ == "__main__":
    recorder = Recorder(Job(path=Path(sys.argv[1]), header=HEADER))
    for index in range(100):
        recorder.push(LAYOUT.pack(tick(index)))
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_gateway_that_is_killed_loses_no_tick(tmp_path: Path) -> None:
    script, path = tmp_path / "killed.py", tmp_path / "a.rlrec"
    script.write_text(GATEWAY_THAT_IS_KILLED)
    ended = subprocess.run(
        [sys.executable, script, path],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
        timeout=60,
        check=False,
    )
    assert ended.returncode == -signal.SIGKILL
    deadline = time.monotonic() + 30.0
    while len(read(path)) < 100:
        assert time.monotonic() < deadline
    assert read(path).records["tick"].tolist() == list(range(100))


@pytest.mark.parametrize(
    ("code", "why"),
    [
        (-9, "killed by SIGKILL"),
        (1, "a mistake in this software"),
        (28, "No space left on device; expected room on the disk"),
        (5, "Input/output error; expected a file to write to"),
    ],
)
def test_true_reason_is_told_why_the_recorder_ended(code: int, why: str) -> None:
    """28 is ENOSPC, 5 is EIO."""
    assert why in reason_of_end(code)
