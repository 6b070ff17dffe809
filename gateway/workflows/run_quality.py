"""The indices of SAE J2951 of a run, from its recording."""

from pathlib import Path

import numpy as np

from gateway.configuration.config import Config
from gateway.cycle.supervisor import State
from gateway.errors import GatewayError
from gateway.offline.drive_quality import DriveQuality, drive_quality
from gateway.physics.road_load import road_load
from gateway.recordings import recording
from gateway.recordings.header import config_of
from gateway.recordings.parts import find_later_parts
from gateway.recordings.recording import GatewayRecording


def quality_of(found: GatewayRecording, config: Config) -> DriveQuality | None:
    """Indices of the drum over the speed that the regulator wanted; None without a run."""
    bench, rows = config.bench, found.records[found.records["state"] == State.RUN]
    rows = rows[np.isfinite(rows["demand"]) & np.isfinite(rows["measured_drum_speed"])]
    wanted = rows["demand"] / bench.gear_ratio * bench.drum_radius
    speed = rows["measured_drum_speed"] * bench.drum_radius
    road = road_load(config.truck, bench)
    return drive_quality(rows["now"], wanted, speed, config.truck.total_mass, road.force)


def quality_at_the_end(path: Path) -> DriveQuality | None:
    """Indices of a run that has just ended.

    None also for a recording that cannot be read, or that has a second part: the end of the daemon
    must not wait for hours of records, which `replay` takes.
    """
    if any(find_later_parts(path)):
        return None
    try:
        found = recording.read(path)
        return quality_of(found, config_of(found.header))
    except GatewayError:
        return None
