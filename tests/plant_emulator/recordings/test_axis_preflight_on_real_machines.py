"""Real axes, whose data may not be copied: nothing false is said, and a turned sign is seen."""

import os
from dataclasses import replace
from pathlib import Path

import pytest

from plant_emulator.errors import LogError
from plant_emulator.recordings.axis_preflight import axis_preflight
from plant_emulator.workflows import axis_reader

ROOT = Path(__file__).parents[3]
DATA = ROOT / os.environ.get("REAL_DATA", "../shared/data")
MACHINES = ("emps/*.mat", "hsm150/*.mat", "real/embir/*.gz", "real/hej90/*.gz", "real/sts3215/*.gz")


@pytest.mark.slow
@pytest.mark.skipif(not DATA.is_dir(), reason=f"{DATA}: no data; set REAL_DATA")
@pytest.mark.parametrize("pattern", MACHINES)
def test_logs_of_a_real_machine_are_taken_and_turned_ones_are_not(pattern: str) -> None:
    # every fourth log: the others are repeats of the same experiment
    for path in sorted(DATA.glob(pattern))[::4]:
        log = axis_reader.read(path)
        told = axis_preflight(log)
        assert all("is new only every" in note for note in told), told
        try:
            turned = axis_preflight(replace(log, force=-log.force))
        except LogError as error:
            turned = [str(error)]
        assert any("wrong sign" in note for note in turned), path
