"""Runs of a program in recordings: what the checks of the commissioning look at."""

from pathlib import Path

import numpy as np

from gateway.commissioning.step_run import StepRun, replay_steps
from gateway.errors import ConfigError
from gateway.offline.recording_replay import observations
from gateway.recordings import recording, steady_runs
from gateway.recordings.export import of_recording, unwrap_time
from gateway.recordings.header import config_of, map_of


def read(path: Path) -> StepRun:
    """Run of a program in a recording.

    Raises ConfigError for a recording without a program, or of one that did not come to its end;
    LossesError for a recording without samples.
    """
    found = recording.read(path)
    config, register_map = config_of(found.header), map_of(found.header)
    if config.program is None:
        raise ConfigError(
            "not the run of a program", file=path, expected="a recording of drive, ready or verify"
        )
    seen = observations(found.rows(), register_map)
    numbers, oil, finished = replay_steps(config, register_map, seen)
    if not finished:
        raise ConfigError(
            f"the run of {config.program.name} did not come to its end",
            file=path,
            value=found.stop_reason() or "no run",
            expected="a whole run: its part may pass where the rest would not",
        )
    samples = of_recording(found)
    rows = found.records[samples]
    beats = unwrap_time(rows["measured_plc_heartbeat"], register_map.modulus("plc_heartbeat"))
    return StepRun(
        config=config,
        trace=steady_runs.trace_of(found, register_map),
        current=rows["measured_armature_current"],
        own_time=rows["now"],
        heartbeat=beats,
        oil_temperature=np.array(oil)[samples],
        steps=np.array(numbers)[samples],
    )
