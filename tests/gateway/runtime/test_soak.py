"""A short soak: run after run, nothing grows. `tests/gateway/soak.py` is the long one."""

from pathlib import Path

import pytest

from gateway.recordings.recording import read
from plant_emulator.emulator.process import EmulatorProcess
from tests.gateway.soak import Soak


@pytest.mark.slow
def test_run_after_run_leaves_no_file_no_thread_no_lost_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(tmp_path))
    with EmulatorProcess(speed=None, driver="none") as emulator:
        soak = Soak(emulator, tmp_path)
        first, *others = soak.runs(4, drive=0.5)
    for found in others:
        assert (found.files, found.threads) == (first.files, first.threads)
        assert (found.dropped, found.lost) == (0, first.lost)
        assert found.gateway == pytest.approx(first.gateway, abs=2.0)
    records = read(tmp_path / "soak.rlrec").records
    assert records["tick"].tolist() == list(range(soak.ticks))
