"""Long recordings: parts, compression, retention, waits that are not written, files of trips."""

import gzip
import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gateway
from gateway.configuration.config import Config
from gateway.cycle import cycle
from gateway.cycle.record import NOTHING, Tick
from gateway.cycle.supervisor import State
from gateway.errors import GatewayError
from gateway.reasons import Reason
from gateway.recordings import triggers
from gateway.recordings.parts import Keeping, Parts, remove_old
from gateway.recordings.recorder import Job, Recorder
from gateway.recordings.recording import read, stream
from gateway.recordings.triggers import Trips, Wait
from tests.gateway.closed_loop import ClosedLoop, Reading
from tests.gateway.recordings.test_recorder import HEADER, LAYOUT, tick

HEAD = HEADER.encode()
WAITING = int(State.CONNECT)


def packed(index: int) -> bytes:
    return LAYOUT.pack(tick(index))


def ticks_in(content: bytes) -> list[int]:
    found: list[int] = np.frombuffer(content, np.dtype(LAYOUT.formats))["tick"].tolist()
    return found


def written(path: Path, keeping: Keeping, count: int) -> Parts:
    path.write_bytes(HEAD)
    parts = Parts(path, HEAD, keeping)
    for index in range(count):
        parts.write(packed(index), 0.01 * index)
    parts.close()
    return parts


def test_recording_in_parts_is_read_as_one_run(tmp_path: Path) -> None:
    path = tmp_path / "a.rlrec"
    written(path, Keeping(size=len(HEAD) + 10 * LAYOUT.size), 35)
    names = sorted(one.name for one in tmp_path.iterdir())
    assert names == ["a.002.rlrec.gz", "a.003.rlrec.gz", "a.004.rlrec", "a.rlrec.gz"]
    first = tmp_path / "a.rlrec.gz"
    assert gzip.decompress(first.read_bytes()) == HEAD + b"".join(map(packed, range(10)))
    assert read(first).records["tick"].tolist() == list(range(35))
    streamed = stream(first)
    assert len(streamed) == 35
    assert [k for chunk in streamed.chunks() for k in chunk["tick"]] == list(range(35))
    assert read(tmp_path / "a.003.rlrec.gz").records["tick"].tolist() == list(range(20, 30))


def test_part_ends_after_its_time(tmp_path: Path) -> None:
    """2.5 s of ticks in parts of 1 s."""
    written(tmp_path / "a.rlrec", Keeping(time=1.0), 250)
    assert [len(read(path)) for path in sorted(tmp_path.glob("a.0*"))] == [100, 50]


def test_recorder_rotates_while_the_loop_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "a.rlrec"
    keeping = Keeping(size=len(HEAD) + 20 * LAYOUT.size)
    recorder = Recorder(Job(path=path, header=HEADER, keeping=keeping))
    for index in range(200):
        recorder.push(packed(index))
        if index % 50 == 0:
            time.sleep(0.1)  # the recorder takes its batches in real time
    recorder.close()
    first = next(one for one in (path, tmp_path / "a.rlrec.gz") if one.exists())
    assert read(first).records["tick"].tolist() == list(range(200))


def test_later_part_is_not_replayed_and_the_error_says_why(tmp_path: Path) -> None:
    path = tmp_path / "a.rlrec"
    path.write_bytes(HEAD + packed(7))
    with pytest.raises(GatewayError, match=r"tick 7: the run began earlier; expected the first"):
        gateway.replay(path)


def aged(folder: Path, name: str, days: float, size: int = 100) -> None:
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(bytes(size))
    os.utime(path, (time.time() - 86400.0 * days,) * 2)


def left_in(folder: Path) -> set[str]:
    return {str(one.relative_to(folder)) for one in folder.rglob("*") if one.is_file()}


def test_old_recordings_and_old_trips_are_removed_and_nothing_else(tmp_path: Path) -> None:
    for name in ("old.rlrec", "old.002.rlrec.gz", "trips/old.001.rlrec", "mine.csv", "now.rlrec"):
        aged(tmp_path, name, 40.0)
    for name in ("young.rlrec", "trips/young.001.rlrec"):
        aged(tmp_path, name, 1.0)
    remove_old(tmp_path, Keeping(age=30 * 86400.0), spared=tmp_path / "now.rlrec")
    kept = {"mine.csv", "now.rlrec", "young.rlrec", "trips/young.001.rlrec"}
    assert left_in(tmp_path) == kept


def test_old_recordings_are_removed_at_the_start_of_a_run_too(tmp_path: Path) -> None:
    """Runs may all be shorter than a part."""
    aged(tmp_path, "old.rlrec", 40.0)
    path = tmp_path / "now.rlrec"
    written(path, Keeping(age=30 * 86400.0), 3)
    assert left_in(tmp_path) == {"now.rlrec"}


def test_oldest_recordings_give_way_to_the_total_size_and_trips_stay(tmp_path: Path) -> None:
    for days, name in enumerate(("now", "a", "b", "c")):
        aged(tmp_path, f"{name}.rlrec", float(days))
    aged(tmp_path, "trips/c.001.rlrec", 9.0)
    remove_old(tmp_path, Keeping(total=250.0), spared=tmp_path / "now.rlrec")
    assert left_in(tmp_path) == {"now.rlrec", "a.rlrec", "trips/c.001.rlrec"}


def test_nothing_is_removed_unless_it_is_asked_for(tmp_path: Path) -> None:
    aged(tmp_path, "a.rlrec", 1e4)
    remove_old(tmp_path, Keeping(), spared=tmp_path / "now.rlrec")
    assert left_in(tmp_path) == {"a.rlrec"}


def waiting(index: int) -> Tick:
    return replace(tick(index, read_back=False), state=WAITING, fault=int(Reason.NOT_CONNECTED))


def test_long_wait_for_the_plc_is_written_at_its_beginning_and_at_its_end() -> None:
    """20 s of wait at 100 Hz, then two ticks with an image; 3 s are kept at both ends."""
    wait = Wait(LAYOUT.formats)
    made = [*map(waiting, range(2000)), tick(2000), tick(2001)]
    content = b"".join(wait.filter(LAYOUT.pack(one)) for one in made) + wait.flush()
    kept = ticks_in(content)
    assert kept == sorted(set(kept))
    assert set(kept) >= {*range(300), *range(1710, 2002)}
    assert len(kept) <= 605


def test_end_of_a_wait_without_a_plc_is_written_too() -> None:
    wait = Wait(LAYOUT.formats)
    content = b"".join(wait.filter(LAYOUT.pack(waiting(k))) for k in range(1000)) + wait.flush()
    assert ticks_in(content)[-1] == 999


def test_run_without_the_middle_of_its_wait_comes_out_bit_for_bit() -> None:
    def absent(loop: ClosedLoop, reading: Reading) -> Reading:
        return Reason.NOT_CONNECTED if loop.now < 20.0 else reading

    loop = ClosedLoop(Config(), disturb=absent)
    loop.run(20.5)
    loop.operate(remote=True)
    loop.run(1.0)
    assert loop.last.state is State.RUN
    seen = list(zip(loop.observations, loop.outputs, strict=True))
    kept = [pair for pair in seen if not triggers.WAIT < pair[0].now < 20.0 - triggers.WAIT]
    assert len(kept) < len(seen) - 1000
    state = cycle.initial(loop.config, loop.map)
    for observation, recorded in kept:
        state, output = cycle.step(loop.config, loop.map, state, observation)
        assert output == recorded


def run_of(path: Path, reason: int) -> None:
    """20 s of RUN, then 20 s after its end for this reason."""
    trips = Trips(path, HEAD, LAYOUT.formats)
    for index in range(4000):
        state, why = (State.RUN, NOTHING) if index < 2000 else (State.RAMPDOWN, reason)
        trips.take(LAYOUT.pack(replace(tick(index), state=state, reason=why)))
    trips.close()


def test_trip_leaves_a_file_of_ten_seconds_before_and_five_after(tmp_path: Path) -> None:
    run_of(tmp_path / "a.rlrec", int(Reason.STALE))
    found = read(tmp_path / "trips" / "a.001.rlrec").records
    assert found["tick"][0] == pytest.approx(1000, abs=1)
    assert found["tick"][-1] == pytest.approx(2500, abs=1)
    assert np.all(np.diff(found["tick"].astype(int)) == 1)


def test_operator_who_ends_a_run_is_no_trip(tmp_path: Path) -> None:
    run_of(tmp_path / "a.rlrec", int(Reason.REMOTE_OFF))
    assert not (tmp_path / "trips").exists()
