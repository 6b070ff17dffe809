"""Put a recording or a log through the regulator again, bit for bit or with other parameters."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

import register_maps
from gateway import config_file
from gateway.cli._settings import assignments
from gateway.configuration.config import Config
from gateway.cycle.cycle import Output
from gateway.cycle.record import number
from gateway.losses import sections
from gateway.offline import log_replay, replay
from gateway.offline.evaluation import cruise, road_speed, traction_energy
from gateway.recordings import log, recording, steady_runs
from gateway.recordings.header import config_of, map_of
from gateway.reports.replay import Compared, draw, write_csv
from gateway.road_load import road_load
from register_maps.command_line.parameters import PICTURES, Command, OutputFile

EXAMPLE = """
\b
Examples:
  gateway replay recordings/20261121T061045.260875Z.rlrec
  gateway replay program6.csv.gz --set regulator.name=thesis --plot replay.png
"""
PICTURE = OutputFile(endings=PICTURES, path_type=Path)


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("file", metavar="LOG|RECORDING", type=click.Path(path_type=Path))
@click.option("-c", "--config", type=click.Path(path_type=Path), help="TOML file")
@click.option("--set", "values", multiple=True, metavar="KEY=VALUE", help="another parameter")
@click.option("--out", type=OutputFile(path_type=Path), help="write both setpoints to a CSV file")
@click.option("--plot", type=PICTURE, help="draw both setpoints (PNG)")
@click.option("--json", "json_file", type=OutputFile(dash=True), help="run/1; - = stdout")
def command(
    file: Path,
    config: Path | None,
    *,
    values: tuple[str, ...],
    out: Path | None,
    plot: Path | None,
    json_file: str | None,
) -> int:
    """Feed what was measured to the same regulator, supervisor and limits.

    A RECORDING without -c and --set must come out bit for bit (exit code 1 otherwise). With them,
    and for a LOG, the setpoint is compared with the recorded one or with the logged reference.
    """
    changed = assignments(values)
    if recording.is_recording(file):
        found = recording.read(file)
        settings = config_file.load(config) if config else config_of(found.header)
        exact = config is None and not changed
        result = _recording(found, config_file.with_values(settings, changed), exact=exact)
    else:
        settings = config_file.load(config) if config else Config()
        logged, settings = log.read(file), config_file.with_values(settings, changed)
        if warning := _wrong_sign(logged, settings):
            click.echo(f"warning: {file}: {warning}", err=True)
        result = _log(logged, settings)
    if out is not None:
        write_csv(out, result.compared)
    if plot is not None:
        draw(plot, result.compared)
    if json_file is not None:
        with click.open_file(json_file, "w", encoding="utf-8") as target:
            target.write(json.dumps(result.entry) + "\n")
    if json_file != "-":
        click.echo("\n".join(result.lines))
    return 0 if result.holds else 1


@dataclass(frozen=True, kw_only=True)
class Result:
    """What one replay gave: for files, for a machine, for the operator, for the exit code."""

    compared: Compared
    entry: dict[str, Any]
    lines: list[str]
    holds: bool


def _recording(found: recording.Recording, config: Config, *, exact: bool) -> Result:
    register_map = map_of(found.header)
    outputs = list(
        replay.outputs(config, register_map, replay.observations(found.rows(), register_map))
    )
    left = list(replay.differences(found.rows(), outputs, register_map))
    compared = _compared(
        f"{found.path.name}: recorded setpoint and replay",
        found.records["now"] - found.header["started"],
        found.records["setpoint_speed_setpoint"],
        outputs,
    )
    lines = [found.note] if found.note else []
    if not left:
        lines.append(f"{found.path}: {len(outputs)} ticks, equal bit for bit")
    else:
        lines += [_told(found, left, len(outputs)), compared.summary()]
    entry = _entry(config, compared, "recorded") | {
        "missed_deadlines": int(found.records["missed"][-1]) if len(found) else 0,
        "latency_ms": _latency(found.records["latency"]),
    }
    return Result(compared=compared, entry=entry, lines=lines, holds=not (exact and left))


def _told(found: recording.Recording, left: list[replay.Difference], ticks: int) -> str:
    first = left[0]
    when = first.time - found.header["started"]
    return (
        f"{found.path}: {len(left)} of {ticks} ticks differ, the first is tick {first.tick} at "
        f"{when:.3f} s: {first.what} recorded {first.recorded}, replayed {first.replayed}"
    )


def _wrong_sign(found: log.Log, config: Config) -> str:
    """What the commissioning check says against the torque; empty: nothing, or a truck drives."""
    columns = found.columns
    if np.any(np.abs(columns.get("wheel_torque", 0.0)) > steady_runs.TRUCK):
        return ""
    trace = sections.Trace(
        name=found.path.name,
        time=found.time,
        motor_speed=columns["motor_speed"],
        drum_speed=columns["drum_speed"],
        shaft_torque=columns["shaft_torque"],
    )
    try:
        sections.steady(trace, config.bench, config.regulator.torque_offset)
    except sections.SignError as error:
        return str(error)
    except sections.LossesError:
        return ""  # too coarse to tell, as such a log may be
    return ""


def _log(found: log.Log, config: Config) -> Result:
    outputs = log_replay.replay(
        config, register_maps.load(config.plc.map), found.time, found.columns
    )
    compared = _compared(
        f"{found.path.name}: logged reference and setpoint of the gateway",
        found.time - found.time[0],
        found.columns["speed_reference"],
        outputs,
    )
    missing = ", ".join(found.missing())
    lines = [f"not in the log: {missing}"] if missing else []
    return Result(
        compared=compared,
        entry=_entry(config, compared, "logged") | _felt(found, config),
        lines=[*lines, compared.summary()],
        holds=True,
    )


def _compared(title: str, time: Any, wanted: Any, outputs: list[Output]) -> Compared:
    return Compared(
        title=title,
        time=np.asarray(time, dtype=float),
        wanted=np.asarray(wanted, dtype=float),
        found=np.array([_asked(one) for one in outputs]),
        demand=np.array([number(one.demand) for one in outputs]),
        states=[one.state.name for one in outputs],
        reasons=["" if one.reason is None else one.reason.name for one in outputs],
    )


def _asked(output: Output) -> float:
    return number(None if output.setpoint is None else output.setpoint.speed_setpoint)


def _entry(config: Config, compared: Compared, driver: str) -> dict[str, Any]:
    """The answer for a machine; what a replay cannot tell is null."""
    close = compared.agreement()
    return {
        "schema": "run/1",
        "truck_kg": config.truck.total_mass,
        "driver": driver,
        "regulator": config.regulator.name,
        "velocity": {"val1": close and close.val1, "val2": close and close.val2},
        "force": {"target_newton": None, "mean_error_newton": None},
        "energy": {"road_joule": None, "bench_joule": None, "error_percent": None},
        "cycles": len(compared.time),
        "missed_deadlines": 0,
        "latency_ms": {"p50": None, "p99": None, "max": None},
        "stop_reason": next(filter(None, reversed(compared.reasons)), ""),
    }


def _felt(found: log.Log, config: Config) -> dict[str, Any]:
    """What the truck of the log felt: force in cruise and energy, beside those of its road."""
    if "wheel_torque" not in found.columns:
        return {}
    time, road = found.time, road_load(config.truck, config.bench)
    speed = found.columns["drum_speed"] * config.bench.drum_radius
    force = found.columns["wheel_torque"] / config.truck.wheel_radius
    wanted = road_speed(time, force, config.truck.total_mass, road.force)
    energy = traction_energy(time, force, wanted), traction_energy(time, force, speed)
    steady = cruise(time, speed)
    answer: dict[str, Any] = {
        "energy": {
            "road_joule": energy[0],
            "bench_joule": energy[1],
            "error_percent": 100.0 * (energy[1] / energy[0] - 1.0) if energy[0] else None,
        }
    }
    if steady is not None:
        target = float(np.mean([road.force(float(v)) for v in speed[steady]]))
        error = float(force[steady].mean()) - target
        answer["force"] = {"target_newton": target, "mean_error_newton": error}
    return answer


def _latency(latency: Any) -> dict[str, float | None]:
    if not len(latency):
        return {"p50": None, "p99": None, "max": None}
    p50, p99 = np.quantile(latency, [0.5, 0.99])
    return {"p50": 1e3 * p50, "p99": 1e3 * p99, "max": 1e3 * float(np.max(latency))}
