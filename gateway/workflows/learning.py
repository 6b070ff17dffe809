"""The memory of the learned regulator: recording in, file for `regulator.learned` out."""

from pathlib import Path

from gateway.configuration.config import Config
from gateway.offline.learning import memory_after
from gateway.offline.recording_replay import observations
from gateway.recordings import recording
from gateway.recordings.header import map_of


def save_memory(run: Path, config: Config, path: Path) -> None:
    """Write what the regulator remembers after a recorded run.

    run : the recording; config : under which the run is repeated

    Raises ConfigError for another regulator, RecordingError for a file that is no recording.
    """
    found = recording.read(run)
    known = map_of(found.header)
    memory = memory_after(config, known, observations(found.rows(), known))
    path.write_text(memory.toml, encoding="utf-8")
