"""A forklift on the emulated bench, and the gateway that makes it feel the road.

The emulator runs in its own process. The gateway talks to it over a real Modbus TCP socket, and
`operator` plays the operator between them. Each truck leaves a configuration, a recording, a log
and what the daemon printed; all trucks together leave a picture and a summary.
"""

import json
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from rich.console import Console

from gateway.config_file import load
from gateway.demo import plot
from gateway.demo.bench_run import BenchRun, curves_of, drive_on_road, figures_of
from gateway.demo.operator import Session, operate_fast, operate_in_real_time
from gateway.demo.options import UNLOADED, DemoOptions
from gateway.demo.view import Screen
from gateway.errors import GatewayError
from gateway.offline.evaluation import agreement
from gateway.offline.figures import RunFigures
from gateway.reasons import Reason
from gateway.recordings import recording
from gateway.recordings.header import config_of
from gateway.workflows.learning import save_memory
from plant_emulator import logs
from plant_emulator.emulator.process import EmulatorProcess
from plant_emulator.signals.log import Log
from plant_emulator.simulation.truck import Forklift


@dataclass(frozen=True, kw_only=True)
class DemoResult:
    """Key figures of every truck, and one line for each run that did not end as it should.

    figures : of the last run of each truck; earlier : of the repeats before it, truck by truck
    """

    figures: tuple[RunFigures, ...]
    earlier: tuple[RunFigures, ...]
    failures: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the figures as the document demo/1."""
        return {
            "schema": "demo/1",
            "runs": [one.to_json() for one in self.figures],
            "earlier": [one.to_json() for one in self.earlier],
        }


def demo(options: DemoOptions, console: Console) -> DemoResult:
    """Drive every truck, and write picture and summary beside the logs."""
    options.out.mkdir(parents=True, exist_ok=True)
    driven = [_repeat(options, load_mass, console) for load_mass in options.loads]
    runs = [one[-1] for one in driven]
    figures = tuple(figures_of(options, run) for run in runs)
    curves = [
        curves_of(run, _title(one), one.velocity) for run, one in zip(runs, figures, strict=True)
    ]
    plot.draw(curves, options.out / "demo.png")
    result = DemoResult(
        figures=figures,
        earlier=tuple(figures_of(options, run) for one in driven for run in one[:-1]),
        failures=tuple(filter(None, (failure_of(run) for one in driven for run in one))),
    )
    text = json.dumps(result.to_json(), indent=2)
    (options.out / "summary.json").write_text(text + "\n", "utf-8")
    return result


def _repeat(options: DemoOptions, load_mass: float, console: Console) -> list[BenchRun]:
    """Drive one truck through its cycle as often as asked; a run that failed is the last."""
    runs: list[BenchRun] = []
    learned = options.learned
    for number in range(1, options.repeats + 1):
        is_last = number == options.repeats
        out = options.out if is_last else options.out / f"repeat_{number}"
        out.mkdir(parents=True, exist_ok=True)
        runs.append(drive(replace(options, out=out, learned=learned), load_mass, console))
        if is_last or failure_of(runs[-1]):
            break
        close, torque = agreement(runs[-1].road_speed, runs[-1].speed), runs[-1].log["shaft_torque"]
        console.print(
            f"  repeat {number} of {options.repeats}: Val1 {close.val1:.2f} %, "
            f"Val2 {close.val2:.2f} %, shaft torque from {torque.min():.1f} Nm",
            highlight=False,
        )
        if options.regulator == "learned":
            found = runs[-1].recording
            learned = found.path.with_name(f"learned_{runs[-1].truck.mass:.0f}kg.toml")
            save_memory(found.path, config_of(found.header), learned)
    return runs


def _title(run: RunFigures) -> str:
    return f"{run.truck_mass:.0f} kg, regulator {run.regulator}, driver {run.driver}"


def failure_of(run: BenchRun) -> str:
    """Why a run failed; empty where the operator ended it, who alone may do so."""
    reason, code = run.recording.stop_reason(), run.exit_code
    if reason == Reason.REMOTE_OFF.name and not code:
        return ""
    return (
        f"{run.truck.mass:.0f} kg: stopped by {reason or 'nothing'}, exit code {code} of the "
        f"gateway; expected {Reason.REMOTE_OFF.name} and 0, see {run.recording.path}"
    )


def drive(options: DemoOptions, load_mass: float, console: Console) -> BenchRun:
    """Drive one truck with this load [kg] through its cycle."""
    forklift = Forklift(mass=UNLOADED + load_mass)
    title = (
        f"{forklift.mass:.0f} kg, driver {options.driver}, regulator {options.regulator}, "
        f"{1e3 * options.period:g} ms"
    )
    console.print(title, style="bold", highlight=False)
    screen = Screen(console, title, options.duration)
    with _emulator(options, forklift) as emulator, screen.showing():
        session = _session(options, forklift, load_mass, emulator, screen)
        operated = operate_fast(session) if options.fast else operate_in_real_time(session)
        log = _cycle(emulator.log(), emulator.status()["road_load_since"], options.duration)
    if not options.fast:
        console.print(f"  bench: {emulator.report}", highlight=False)
    logs.write(log, session.file.with_suffix(".csv"))
    road_speed, road_force = drive_on_road(options, forklift, log)
    return BenchRun(
        truck=forklift,
        log=log,
        recording=recording.read(operated.recording),
        exit_code=operated.exit_code,
        road_speed=road_speed,
        road_force=road_force,
    )


def _emulator(options: DemoOptions, forklift: Forklift) -> EmulatorProcess:
    return EmulatorProcess(
        truck_mass=forklift.mass,
        driver=options.driver,
        parameters=options.bench_parameters,
        map=options.map,
        speed=None if options.fast else 1.0,
    )


def _session(
    options: DemoOptions,
    forklift: Forklift,
    load_mass: float,
    emulator: EmulatorProcess,
    screen: Screen,
) -> Session:
    """Write the gateway's configuration for this truck, and put the run together."""
    file = options.out / f"truck_{forklift.mass:.0f}kg.toml"
    text = options.config_text(
        load_mass=load_mass,
        rolling=(forklift.crr, forklift.crr_v),
        address=(emulator.host, emulator.port),
    )
    file.write_text(text, encoding="utf-8")
    return Session(
        config=load(file),
        file=file,
        emulator=emulator,
        screen=screen,
        duration=options.duration,
    )


def _cycle(log: Log, start: float, duration: float) -> Log:
    """The part of the emulator's log in which the truck drove its cycle; time from its start."""
    inside = (log.time >= start - 1e-9) & (log.time <= start + duration + 1e-9)
    if np.count_nonzero(inside) < 2:
        raise GatewayError("the bench never came to road-load mode; see the recording")
    time = np.round(log.time[inside] - start, 6)
    return Log(time, {name: values[inside] for name, values in log.signals.items()}, log.source)
