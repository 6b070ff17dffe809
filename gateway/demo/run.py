"""A forklift on the emulated bench, and the gateway that makes it feel the road.

The only module that knows both sides. The emulator runs in its own process and the gateway talks to
it over a real Modbus TCP socket; `demo_operator` plays the operator between them. What is left
behind for each truck: configuration, recording, log, the daemon's words; for all of them a picture
and a summary.
"""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Console

from gateway.arrays import Array
from gateway.config_file import load
from gateway.cycle.supervisor import State
from gateway.demo import plot
from gateway.demo.operator import Session, operate_fast, operate_in_real_time
from gateway.demo.options import UNLOADED, Options
from gateway.demo.view import Screen
from gateway.errors import GatewayError
from gateway.offline.evaluation import agreement, cruise, traction_energy
from gateway.reasons import Reason
from gateway.recordings import recording
from gateway.recordings.recording import Recording
from plant_emulator import logs
from plant_emulator.emulator.process import EmulatorProcess
from plant_emulator.signals.log import Log
from plant_emulator.simulation import truck


@dataclass(frozen=True, kw_only=True)
class BenchRun:
    """One truck's cycle on the bench, on the road, and in the gateway; SI, shape (n,) each.

    exit_code : of the gateway
    road_force : what the truck's drive gives on the road
    """

    truck: truck.Forklift
    log: Log
    recording: Recording
    exit_code: int
    road_speed: Array
    road_force: Array

    @property
    def speed(self) -> Array:
        """Of the drum's rim [m/s]."""
        return self.log["drum_speed"] * self.truck.drum_radius

    @property
    def force(self) -> Array:
        """Of the truck at the rim [N], acting up to its sample."""
        return self.log["wheel_torque"] / self.truck.wheel_radius


@dataclass(frozen=True, kw_only=True)
class DemoResult:
    """The summary of all runs, and what went wrong in them: a line each."""

    summary: dict[str, Any]
    failures: list[str]


def demo(options: Options, console: Console) -> DemoResult:
    """Drive every truck; the summary is also written to `out` beside logs and picture."""
    options.out.mkdir(parents=True, exist_ok=True)
    driven = [drive(options, load_mass, console) for load_mass in options.loads]
    entries = [figures(options, one) for one in driven]
    curves = [_curves(one, entry) for one, entry in zip(driven, entries, strict=True)]
    plot.draw(curves, options.out / "demo.png")
    summary = {"schema": "demo/1", "runs": entries}
    (options.out / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", "utf-8")
    failures = [failure(one, entry) for one, entry in zip(driven, entries, strict=True)]
    return DemoResult(summary=summary, failures=list(filter(None, failures)))


def failure(run: BenchRun, entry: dict[str, Any]) -> str:
    """Why the run is none to show: only the operator may end it. Empty: he did."""
    reason, code = entry["stop_reason"], run.exit_code
    if reason == Reason.REMOTE_OFF.name and not code:
        return ""
    return (
        f"{run.truck.mass:.0f} kg: stopped by {reason or 'nothing'}, exit code {code} of the "
        f"gateway; expected {Reason.REMOTE_OFF.name} and 0, see {run.recording.path}"
    )


def drive(options: Options, load_mass: float, console: Console) -> BenchRun:
    """One truck through its cycle."""
    forklift = truck.Forklift(mass=UNLOADED + load_mass)
    title = (
        f"{forklift.mass:.0f} kg, driver {options.driver}, regulator {options.regulator}, "
        f"{1e3 * options.period:g} ms"
    )
    console.print(title, style="bold", highlight=False)
    screen = Screen(console, title, options.duration)
    file = options.out / f"truck_{forklift.mass:.0f}kg.toml"
    with (
        EmulatorProcess(
            truck_mass=forklift.mass,
            driver=options.driver,
            parameters=options.bench_parameters,
            map=options.map,
            speed=None if options.fast else 1.0,
        ) as emulator,
        screen.showing(),
    ):
        text = options.config_text(
            load_mass=load_mass,
            rolling=(forklift.crr, forklift.crr_v),
            address=(emulator.host, emulator.port),
        )
        file.write_text(text, encoding="utf-8")
        session = Session(
            config=load(file),
            file=file,
            emulator=emulator,
            screen=screen,
            duration=options.duration,
        )
        operate = operate_fast if options.fast else operate_in_real_time
        operated = operate(session)
        log = _cycle(emulator.log(), emulator.status()["road_load_since"], options.duration)
    if not options.fast:
        console.print(f"  bench: {emulator.report}", highlight=False)
    logs.write(log, file.with_suffix(".csv"))
    road_speed, road_force = _road(options, forklift, log)
    return BenchRun(
        truck=forklift,
        log=log,
        recording=recording.read(operated.recording),
        exit_code=operated.exit_code,
        road_speed=road_speed,
        road_force=road_force,
    )


def _cycle(log: Log, began: float, duration: float) -> Log:
    """The part of the emulator's log in which the truck drove its cycle, time from its start."""
    inside = (log.time >= began - 1e-9) & (log.time <= began + duration + 1e-9)
    if np.count_nonzero(inside) < 2:
        raise GatewayError("the bench never came to road-load mode; see the recording")
    time = np.round(log.time[inside] - began, 6)
    return Log(time, {name: values[inside] for name, values in log.signals.items()}, log.source)


def _road(options: Options, forklift: truck.Forklift, log: Log) -> tuple[Array, Array]:
    """Speed [m/s] and drive force [N] of the same truck on the road.

    Driver none: under the very torque that acted on the bench. Driver pi: with the same driver,
    who asks for other torques where the bench gives him other speeds.
    """
    if options.driver == "none":
        speed = truck.road_speed(forklift, log.time, log["wheel_torque"])
        return speed, log["wheel_torque"] / forklift.wheel_radius
    speed, torque = truck.drive_on_road(
        truck.driver_of(options.driver, forklift), forklift, log.time
    )
    return speed, torque / forklift.wheel_radius


def figures(options: Options, run: BenchRun) -> dict[str, Any]:
    """Key figures of one run, as the command answers them (run/1)."""
    found = agreement(run.road_speed, run.speed)
    target, error = _cruise_force(run)
    road = traction_energy(run.log.time, run.road_force, run.road_speed)
    bench = traction_energy(run.log.time, run.force, run.speed)
    ticks = run.recording.records[run.recording.records["state"] == State.RUN]
    return {
        "schema": "run/1",
        "truck_kg": run.truck.mass,
        "driver": options.driver,
        "regulator": options.regulator,
        "velocity": {"val1": found.val1, "val2": found.val2},
        "force": {"target_newton": target, "mean_error_newton": error},
        "energy": {
            "road_joule": road,
            "bench_joule": bench,
            "error_percent": 100.0 * (bench / road - 1.0),
        },
        "cycles": len(ticks),
        "missed_deadlines": int(ticks["missed"][-1] - ticks["missed"][0]) if len(ticks) else 0,
        "latency_ms": _latency(options, ticks["latency"]),
        "stop_reason": run.recording.stop_reason(),
    }


def _cruise_force(run: BenchRun) -> tuple[float | None, float | None]:
    """Road load in cruise and the bench's mean error [N]; None without 5 s of steady travel."""
    steady = cruise(run.log.time, run.speed)
    if steady is None:
        return None, None
    target = float(np.mean([run.truck.road_load(float(v)) for v in run.speed[steady]]))
    return target, float(run.force[steady].mean()) - target


def _latency(options: Options, seconds: Array) -> dict[str, float | None]:
    """Read to written, in ms; None where no clock ran (fast) or no tick was taken."""
    if options.fast or not len(seconds):
        return {"p50": None, "p99": None, "max": None}
    p50, p99, highest = (float(np.quantile(1e3 * seconds, q)) for q in (0.5, 0.99, 1.0))
    return {"p50": p50, "p99": p99, "max": highest}


def _curves(run: BenchRun, entry: dict[str, Any]) -> plot.Curves:
    velocity = entry["velocity"]
    return plot.Curves(
        title=f"{run.truck.mass:.0f} kg, regulator {entry['regulator']}, driver {entry['driver']}",
        note=f"Val1 {velocity['val1']:.1f} %   Val2 {velocity['val2']:.1f} %",
        time=run.log.time,
        road_speed=run.road_speed,
        bench_speed=run.speed,
        wheel_force=run.force,
        road_load=np.array([run.truck.road_load(float(v)) for v in run.road_speed]),
        shaft_torque=run.log["shaft_torque"],
        motor_setpoint=run.log["speed_reference"],
        motor_speed=run.log["motor_speed"],
    )
