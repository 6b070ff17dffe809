"""The replay of a recording or a log: file in, answer out.

A recording under its own configuration has to come out bit for bit. Under other parameters, and
for a log of the bench, the replay's setpoint is compared with the setpoint of the run.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import register_maps
from gateway import config_file
from gateway.configuration.config import Config
from gateway.errors import RecordingError
from gateway.losses import sections
from gateway.offline import log_replay, recording_replay
from gateway.offline.comparison import SetpointComparison, compare
from gateway.offline.drive_quality import drive_quality
from gateway.offline.evaluation import road_speed, traction_energy
from gateway.offline.figures import Latency, RunFigures, TractionEnergy, cruise_force
from gateway.offline.recording_replay import Difference
from gateway.physics.road_load import road_load
from gateway.recordings import log, recording, steady_runs
from gateway.recordings.header import config_of, map_of
from gateway.recordings.recording import GatewayRecording
from gateway.reports.replay import describe_comparison, describe_differences
from gateway.workflows.run_quality import quality_of


@dataclass(frozen=True, kw_only=True)
class Replay:
    """A run that went through regulator, supervisor and limits once more.

    path : the recording or log
    config : configuration of the replay
    comparison : setpoint of the run and setpoint of the replay, tick by tick
    figures : key figures, the content of the document run/1
    differences : ticks of a recording that came out differently; None for a log
    is_exact : whether every tick must come out bit for bit; true for an unchanged recording
    notes, warnings : what the operator should know of the file
    """

    path: Path
    config: Config
    comparison: SetpointComparison
    figures: RunFigures
    differences: tuple[Difference, ...] | None = None
    is_exact: bool = False
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        """False where a recording should have come out bit for bit and did not."""
        return not (self.is_exact and self.differences)

    def to_json(self) -> dict[str, Any]:
        """Return the key figures as the document run/1."""
        return self.figures.to_json()

    def summary(self) -> str:
        """Lines for the operator: the notes, and how the two setpoints compare."""
        lines = list(self.notes)
        if self.differences is not None:
            ticks = len(self.comparison.time)
            lines.append(describe_differences(self.path, self.differences, ticks))
        if self.figures.quality is not None:
            other = "road" if self.differences is None else "demand"
            lines.append(f"SAE J2951, drum over {other}: {self.figures.quality}")
        if self.differences != ():
            lines.append(describe_comparison(self.comparison))
        return "\n".join(lines)

    def __repr__(self) -> str:
        close = self.figures.velocity
        agree = f", Val1 {close.val1:.2f} %, Val2 {close.val2:.2f} %" if close else ""
        return (
            f"<Replay of {self.path.name}: {self.figures.truck_mass:g} kg, "
            f"regulator {self.figures.regulator}, {self.figures.cycles} samples{agree}>"
        )


def replay(
    log_or_recording: str | Path,
    *,
    config: Config | str | Path | None = None,
    values: Mapping[str, object] | None = None,
) -> Replay:
    """Put a log or a recording through regulator, supervisor and limits again.

    log_or_recording : path of a log (CSV, Parquet, MDF4) or of a recording of the gateway
    config : configuration, or path of its TOML file; default: that of the recording, for a log the
        defaults of the gateway
    values : keys to change, `{"truck.load_kg": 1600}`; a text is read as TOML

    Raises GatewayError (ConfigError, LogError, RecordingError) for a file that cannot be used.
    """
    path, changes = Path(log_or_recording), dict(values or {})
    if recording.is_recording(path):
        found = _from_its_start(recording.read(path))
        own = config_of(found.header) if config is None else config_file.as_config(config)
        settings = config_file.with_values(own, changes)
        return _replay_recording(found, settings, is_exact=config is None and not changes)
    settings = config_file.with_values(config_file.as_config(config or Config()), changes)
    return _replay_log(log.read(path), settings)


def _from_its_start(found: GatewayRecording) -> GatewayRecording:
    """The recording, if it has the first tick of its run. Raises RecordingError."""
    if len(found) and found.records["tick"][0]:
        raise RecordingError(
            "the run began earlier",
            file=found.path,
            place=f"tick {found.records['tick'][0]}",
            expected="the first part of a recording, from which a replay can begin",
        )
    return found


def _replay_recording(found: GatewayRecording, config: Config, *, is_exact: bool) -> Replay:
    register_map, started = map_of(found.header), found.header.started
    seen = recording_replay.observations(found.rows(), register_map)
    outputs = list(recording_replay.outputs(config, register_map, seen))
    comparison = compare(
        f"{found.path.name}: recorded setpoint and replay",
        found.records["now"] - started,
        found.records["setpoint_speed_setpoint"],
        outputs,
    )
    return Replay(
        path=found.path,
        config=config,
        comparison=comparison,
        figures=replace(
            _figures(config, comparison, "recorded"),
            missed_deadlines=int(found.records["missed"][-1]) if len(found) else 0,
            latency=Latency.of(found.records["latency"]),
            quality=quality_of(found, config),
        ),
        differences=tuple(
            replace(one, time=one.time - started)
            for one in recording_replay.differences(found.rows(), outputs, register_map)
        ),
        is_exact=is_exact,
        notes=(found.note,) if found.note else (),
    )


def _replay_log(found: log.Log, config: Config) -> Replay:
    register_map = register_maps.load(config.plc.map)
    outputs = log_replay.replay(config, register_map, found.time, found.columns)
    comparison = compare(
        f"{found.path.name}: logged reference and setpoint of the gateway",
        found.time - found.time[0],
        found.columns["speed_reference"],
        outputs,
    )
    missing = ", ".join(found.missing_columns())
    warning = _wrong_sign(found, config)
    return Replay(
        path=found.path,
        config=config,
        comparison=comparison,
        figures=_with_truck(_figures(config, comparison, "logged"), found, config),
        notes=(f"not in the log: {missing}",) if missing else (),
        warnings=(warning,) if warning else (),
    )


def _figures(config: Config, comparison: SetpointComparison, driver: str) -> RunFigures:
    """Key figures that any replay shows."""
    return RunFigures(
        truck_mass=config.truck.total_mass,
        driver=driver,
        regulator=config.regulator.name,
        velocity=comparison.agreement(),
        cycles=len(comparison.time),
        stop_reason=next(filter(None, reversed(comparison.reasons)), ""),
    )


def _with_truck(figures: RunFigures, found: log.Log, config: Config) -> RunFigures:
    """Add force and energy of the truck in the log, beside those of its road."""
    if "wheel_torque" not in found.columns:
        return figures
    time, road = found.time, road_load(config.truck, config.bench)
    speed = found.columns["drum_speed"] * config.bench.drum_radius
    force = found.columns["wheel_torque"] / config.truck.wheel_radius
    speed_on_road = road_speed(time, force, config.truck.total_mass, road.force)
    energy = TractionEnergy(
        road=traction_energy(time, force, speed_on_road), bench=traction_energy(time, force, speed)
    )
    quality = drive_quality(time, speed_on_road, speed, config.truck.total_mass, road.force)
    return replace(
        figures,
        energy=energy,
        force=cruise_force(time, speed, force, road.force),
        quality=quality,
    )


def _wrong_sign(found: log.Log, config: Config) -> str:
    """Why the logged torque seems to have the wrong sign; empty: it has not, or a truck drives."""
    columns = found.columns
    if np.any(np.abs(columns.get("wheel_torque", 0.0)) > steady_runs.TRUCK):
        return ""
    trace = sections.SweepTrace(
        name=found.path.name,
        time=found.time,
        motor_speed=columns["motor_speed"],
        drum_speed=columns["drum_speed"],
        shaft_torque=columns["shaft_torque"],
    )
    try:
        sections.steady(trace, config.bench, config.regulator)
    except sections.SignError as error:
        return str(error)
    except sections.LossesError:
        return ""  # the log is too coarse to show its friction, which a replay does not need
    return ""
