"""A disk that is full at the start, stands still, or refuses the file of a trip."""

import multiprocessing
import os
import resource
import signal
import time
from dataclasses import replace
from pathlib import Path

import pytest

from gateway.cycle.supervisor import State
from gateway.errors import GatewayError
from gateway.reasons import Reason
from gateway.recordings import recorder
from gateway.recordings.parts import TRIPS
from gateway.recordings.recorder import Job, Recorder
from gateway.recordings.recording import read
from tests.gateway.recordings.test_recorder import HEADER, LAYOUT, tick


def test_disk_that_is_full_at_the_start_is_no_bad_input_and_leaves_no_file(tmp_path: Path) -> None:
    """systemd starts the gateway again after exit code 1, and not after 2."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))
    try:
        with pytest.raises(GatewayError, match="expected room on the disk") as raised:
            Recorder(Job(path=tmp_path / "a.rlrec", header=HEADER))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert raised.value.exit_code == 1
    assert list(tmp_path.iterdir()) == []


def test_recorder_that_stands_still_does_not_keep_the_gateway_from_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a network drive that no longer answers."""
    monkeypatch.setattr(recorder, "PATIENCE", 0.3)
    stalled = Recorder(Job(path=tmp_path / "a.rlrec", header=HEADER))
    (child,) = multiprocessing.active_children()
    assert child.pid is not None
    os.kill(child.pid, signal.SIGSTOP)
    with pytest.raises(GatewayError, match=r"the recorder has not ended in 0\.3 s"):
        stalled.close()
    child.join(10.0)
    assert child.exitcode == -signal.SIGKILL


def test_trip_whose_file_cannot_be_written_ends_no_recording(tmp_path: Path) -> None:
    path = tmp_path / "a.rlrec"
    (tmp_path / TRIPS).write_text("a file in the place of the folder")
    tripping = Recorder(Job(path=path, header=HEADER))
    for index in range(200):
        state = State.RUN if index < 100 else State.RAMPDOWN
        tripping.push(LAYOUT.pack(replace(tick(index), state=state, reason=int(Reason.STALE))))
        if index == 150:
            time.sleep(0.2)  # the recorder meets the trip before the last records
    assert not tripping.failed
    with pytest.raises(GatewayError, match="the recorder failed: File exists; expected a file"):
        tripping.close()
    assert read(path).records["tick"].tolist() == list(range(200))
