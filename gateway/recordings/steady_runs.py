"""Runs without a truck in files: logs and recordings, for the measurement of losses."""

import hashlib
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.arrays import Array
from gateway.configuration.config import Config
from gateway.losses.sections import LossesError, SweepTrace
from gateway.recordings import log, recording
from gateway.recordings.export import of_recording, unwrap_time
from gateway.recordings.header import config_of, map_of
from gateway.recordings.log import LogError
from register_maps.register_map import RegisterMap
from register_maps.signals import Status

TRUCK: Final = 1.0
"""[N m] Torque at the truck's wheel above which a truck drives or brakes."""


@dataclass(frozen=True, kw_only=True)
class SteadyRun:
    """A run in a file.

    date : of the recording, or of the last change of a log
    sha256 : of the file
    config : configuration of a recording, None: a log has none
    """

    path: Path
    date: datetime
    sha256: str
    trace: SweepTrace
    config: Config | None = None


def read(path: Path) -> SteadyRun:
    """Run in a log or a recording.

    Raises ConfigError for a file that cannot be used, LossesError where a truck is on the drum.
    """
    is_recording = recording.is_recording(path)
    changed = datetime.fromtimestamp(path.stat().st_mtime, UTC)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    if not is_recording:
        return SteadyRun(path=path, date=changed, sha256=digest, trace=_of_log(log.read(path)))
    found = recording.read(path)
    return SteadyRun(
        path=path,
        date=datetime.fromisoformat(found.header.date),
        sha256=digest,
        trace=trace_of(found, map_of(found.header)),
        config=config_of(found.header),
    )


def _of_log(found: log.Log) -> SweepTrace:
    columns = found.columns
    wheel = columns.get("wheel_torque")
    if wheel is not None and float(np.abs(wheel).max()) > TRUCK:
        raise LogError(
            "a truck stands on the drum",
            file=found.path,
            place="column wheel_torque_Nm",
            value=float(wheel[np.argmax(np.abs(wheel))]),
            expected="a run without a truck, whose torque is no loss of the bench",
        )
    return SweepTrace(
        name=found.path.name,
        time=found.time,
        motor_speed=columns["motor_speed"],
        drum_speed=columns["drum_speed"],
        shaft_torque=columns["shaft_torque"],
        shell_temperature=columns.get("shell_temperature"),
    )


def trace_of(found: recording.GatewayRecording, register_map: RegisterMap) -> SweepTrace:
    """Signals of a recording at its samples. Raises LossesError where a truck was driven."""
    rows = found.records[of_recording(found)]
    if len(rows) < 2:
        raise LossesError(f"{found.path}: holds no samples of the PLC; expected a run")
    if np.any(rows["measured_status"].astype(int) & Status.ROAD_LOAD):
        raise LossesError(
            f"{found.path}: was made in road load with a truck on the drum, whose torque is "
            "no loss of the bench; expected a sweep of steady speeds (gateway losses -c CONFIG)"
        )
    time = unwrap_time(rows["measured_plc_time"], register_map.modulus("plc_time"))
    return SweepTrace(
        name=found.path.name,
        time=time,
        motor_speed=rows["measured_motor_speed"],
        drum_speed=rows["measured_drum_speed"],
        shaft_torque=_mean_torque(rows, time, register_map.modulus("shaft_torque_integral")),
        shell_temperature=_shell(rows),
    )


def _mean_torque(rows: Any, time: Array, modulus: float | None) -> Array:
    """Mean torque up to each sample [N m], from the integral where the PLC has one."""
    sampled: Array = rows["measured_shaft_torque"]
    integral = rows["measured_shaft_torque_integral"]
    if not np.isfinite(integral).all():
        return sampled
    change = np.diff(integral)
    if modulus is not None:
        change = np.mod(change + 0.5 * modulus, modulus) - 0.5 * modulus
    mean: Array = np.concatenate((sampled[:1], change / np.diff(time)))
    return mean


def _shell(rows: Any) -> Array | None:
    """Mean of the thermocouples that work all the time [K]; None: none does."""
    both = [rows[f"measured_shell_temperature_{number}"] for number in (1, 2)]
    working = [one for one in both if np.isfinite(one).all()]
    mean: Array | None = np.mean(working, axis=0) if working else None
    return mean
