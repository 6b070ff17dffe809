"""The loop from a hidden cause to a repaired force: drive, diagnose, unseal, regulate.

A bench hides an effect. `gateway drive` runs programs on it over the socket, `plant-emulator
diagnose` reads the recordings' logs alone, and the set that it saves goes into the regulator. A
truck then tells by its force in cruise what that was worth.
"""

import json
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from rich.console import Console

from gateway.config_file import load
from gateway.cycle.supervisor import State
from gateway.demo import plot
from gateway.demo.bench_run import BenchRun, curves_of
from gateway.demo.operator import Follower, Session, wait_for
from gateway.demo.options import DemoOptions
from gateway.demo.run import drive as drive_truck
from gateway.demo.run import failure_of
from gateway.demo.seal import Truth, draw
from gateway.demo.view import Screen
from gateway.errors import GatewayError
from gateway.offline.evaluation import agreement
from gateway.offline.figures import CruiseForce, cruise_force
from gateway.recordings.parts import SUFFIX
from plant_emulator import effects, parameter_sets
from plant_emulator.emulator.process import EmulatorProcess
from plant_emulator.model.sensors import Sensor

PROGRAMS: Final = ("program1", "program2", "program3")
"""Two others predict each run. The levels and stops of program 3 show what ramps do not: a friction
of the drum, 32 N m for instance, is not named without them."""
NOISE: Final = {
    "motor_speed": 0.15,
    "drum_speed": 0.01,
    "armature_current": 0.25,
    "armature_voltage": 0.5,
    "shaft_torque": 0.25,
}
"""Standard deviation of each sensor of the bench [SI]."""
TORQUE_PERCENT: Final = 40.0
"""Tolerance of the motor's torque balance: with the usual 20 %, a torque sensor that lags by 37 ms
may end the drive where the flanks meet, and its log is what the diagnosis needs."""
OPEN_GAP: Final = 1.1
"""Gap of a channel from which on it counts, in the noise [1], as in `diagnose`."""
STOPPED, DRIVES = 0.02, 3
"""[s] Lateness of the emulated PLC from which on a run is driven again, and number of runs: a PLC
that is late by two scans takes a command of another scan than the log tells. After a stop of 80 ms
the drive's current was 17 times its noise beside a simulation of the truth."""
BEGINS_WITHIN: Final = 60.0
"""[s] Longest time from a start of the emulator to a run of the gateway."""


@dataclass(frozen=True, kw_only=True)
class GapResult:
    """The result of the closed loop.

    answer : of the diagnosis, as its document; before, after : force of the truck in cruise with
        the nominal friction and with the diagnosed set, None: the truck did not come to cruise
    seconds : that the whole took
    """

    truth: Truth
    answer: dict[str, Any]
    before: CruiseForce | None
    after: CruiseForce | None
    seconds: float

    @property
    def named(self) -> bool:
        """Whether the diagnosis named the hidden effect and nothing else."""
        return bool(self.answer["verdict"]["effects"] == [self.truth.effect])

    @property
    def closed(self) -> float | None:
        """Share that the effect closes of the gap that other parameters leave [1].

        None: nothing was named, or that gap is within 1.1 times the noise.
        """
        found: float | None = self.answer["gap"]["closed_fraction"]
        return found

    @property
    def closed_of_nominal(self) -> float | None:
        """Share that set and effect close of the gap of the model in force [1].

        1 - sum max(0, (explained/noise)^2 - 1) / sum ((nominal/noise)^2 - 1)

        over the channels with a nominal gap of 1.1 times the noise; None where there is none.
        """
        gap, noise = self.answer["gap"], self.answer["gap"]["noise_floor"]
        open_ = [name for name in noise if gap["nominal"][name] >= OPEN_GAP * noise[name]]
        if not self.answer["verdict"]["effects"] or not open_:
            return None
        before = sum((gap["nominal"][name] / noise[name]) ** 2 - 1.0 for name in open_)
        left = sum(max(0.0, (gap["explained"][name] / noise[name]) ** 2 - 1.0) for name in open_)
        return float(1.0 - left / before)

    def to_json(self) -> dict[str, Any]:
        """Return the loop as the document gap/1."""
        verdict = self.answer["verdict"]
        return {
            "schema": "gap/1",
            "truth": asdict(self.truth) | {"sha256": self.truth.seal},
            "named": self.named,
            "verdict": {key: verdict[key] for key in ("kind", "effects", "class", "statement")},
            "gap_closed": self.closed,
            "gap_closed_of_nominal": self.closed_of_nominal,
            "force": {
                "before": self.before and asdict(self.before),
                "after": self.after and asdict(self.after),
            },
            "seconds": self.seconds,
        }


def close_gap(seed: int, out: Path, console: Console) -> GapResult:
    """Run the whole loop, and leave recordings, logs, report, set, picture and summary in `out`."""
    since, truth = time.monotonic(), draw(seed)
    console.print(f"sealed: sha256 {truth.seal}")
    out.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as hidden:
        bench = _hidden_set(Path(hidden), truth)
        logs = [drive(program, bench, out, console) for program in PROGRAMS]
        answer = diagnose(logs, out, console)
        console.print(f"unsealed: {truth.text}")
        (out / "seal.json").write_text(truth.text, "utf-8")
        runs = [_truck(bench, friction, out, console) for friction in (None, out / "set.toml")]
    forces = [felt(run) for run in runs]
    curves = [_add_titles(*one) for one in zip(("before", "after"), runs, forces, strict=True)]
    plot.draw(curves, out / "gap.png")
    result = GapResult(
        truth=truth,
        answer=answer,
        before=forces[0],
        after=forces[1],
        seconds=time.monotonic() - since,
    )
    (out / "summary.json").write_text(json.dumps(result.to_json(), indent=2) + "\n", "utf-8")
    return result


def _hidden_set(folder: Path, truth: Truth) -> Path:
    """Parameter set of the bench that hides the truth, with the noise of its sensors."""
    path = folder / "bench.toml"
    sensors = {name: Sensor(noise=noise) for name, noise in NOISE.items()}
    chosen = effects.parse((truth.option,))
    parameter_sets.save(replace(parameter_sets.load(), effects=chosen, sensors=sensors), path)
    return path


def drive(program: str, bench: Path, out: Path, console: Console) -> Path:
    """Drive a program by `gateway drive` on the emulated bench; return the log of the run.

    A run in which the computer stopped the emulated PLC is driven again, DRIVES times at most: such
    a PLC follows a command later than the log tells. The folder of each run stays.

    Raises GatewayError where a run did not come to its end.
    """
    for number in range(1, DRIVES + 1):
        folder = out / (program if number == 1 else f"{program}_{number}")
        log, report = _drive_once(program, bench, folder, console)
        stopped = longest_stop(report)
        if stopped < STOPPED:
            break
        console.print(f"  the computer stopped the emulated PLC for {1e3 * stopped:.0f} ms")
    return log


def longest_stop(report: str) -> float:
    """Largest lateness of a scan [s] in the emulator's report of its timing."""
    found = re.search(r"lateness .* max ([\d.]+) ms, scan", report)
    assert found is not None, report
    return float(found[1]) / 1e3


def _drive_once(program: str, bench: Path, folder: Path, console: Console) -> tuple[Path, str]:
    """Log of one run, and the emulator's report of its timing."""
    console.print(f"gateway drive {program}")
    folder.mkdir(parents=True, exist_ok=True)
    before = set(folder.glob("*.csv.gz"))
    with EmulatorProcess(truck_mass=None, parameters=bench) as emulator:
        file = folder / "bench.toml"
        file.write_text(
            f'[plc]\nhost = "{emulator.host}"\nport = {emulator.port}\n\n'
            f"[plausibility]\ntorque_percent = {TORQUE_PERCENT}\n",
            "utf-8",
        )
        with _daemon("drive", program, "-c", file, "--out", folder) as (gateway, recording):
            screen = Screen(console, program, 0.0)
            session = Session(
                config=load(file), file=file, emulator=emulator, screen=screen, duration=0.0
            )
            look = Follower(recording, session)
            wait_for("ARMED", lambda: look.state() is State.ARMED, gateway)
            emulator.set_remote(on=True)
            if gateway.wait() != 0:
                raise GatewayError(f"{program} did not come to its end: see {folder}/gateway.txt")
    (log,) = set(folder.glob("*.csv.gz")) - before
    return log, emulator.report


@contextmanager
def _daemon(*words: object) -> Iterator[tuple["subprocess.Popen[bytes]", Path]]:
    """A command of the gateway in its own process, and the recording that it writes."""
    folder = Path(str(words[-1]))
    before = set(folder.glob(f"*{SUFFIX}"))
    command = [sys.executable, "-m", "gateway", *map(str, words)]
    with (folder / "gateway.txt").open("w", encoding="utf-8") as said:
        gateway = subprocess.Popen(
            command, stdout=said, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL
        )
        with gateway:
            try:
                wait_for("a recording", lambda: bool(_new(folder, before)), gateway, BEGINS_WITHIN)
                yield gateway, _new(folder, before).pop()
            finally:
                gateway.terminate()


def _new(folder: Path, before: set[Path]) -> set[Path]:
    return set(folder.glob(f"*{SUFFIX}")) - before


def diagnose(logs: list[Path], out: Path, console: Console) -> dict[str, Any]:
    """Answer of `plant-emulator diagnose` on these logs; it leaves set and report in `out`.

    Raises GatewayError where the command fails.
    """
    console.print("plant-emulator diagnose")
    files = {
        "--json": "diagnosis.json",
        "--report": "diagnosis.html",
        "--save": "set.toml",
        "--drafts": "drafts",
    }
    options = [word for option, name in files.items() for word in (option, str(out / name))]
    command = [sys.executable, "-m", "plant_emulator", "diagnose", *map(str, logs), *options]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        raise GatewayError(f"the diagnosis failed: {ended.stderr.strip()}")
    answer: dict[str, Any] = json.loads((out / "diagnosis.json").read_text("utf-8"))
    console.print(f"  {answer['verdict']['statement']}")
    return answer


def _truck(bench: Path, friction: Path | None, out: Path, console: Console) -> BenchRun:
    """A truck with a driver on the bench, with the nominal friction or that of a set."""
    options = DemoOptions(
        loads=(0.0,),
        driver="pi",
        bench_parameters=str(bench),
        friction=None if friction is None else str(friction),
        fast=True,
        out=out / ("before" if friction is None else "after"),
    )
    options.out.mkdir(parents=True, exist_ok=True)
    return drive_truck(options, 0.0, console)


def felt(run: BenchRun) -> CruiseForce | None:
    """Force on the truck while it cruises on its road; None where the gateway ended the run."""
    if failure_of(run):
        return None
    return cruise_force(run.log.time, run.road_speed, run.force, run.truck.road_load)


def _add_titles(name: str, run: BenchRun, force: CruiseForce | None) -> plot.Curves:
    """Curves of a run with the error of its force."""
    title = f"{name}: force in cruise {told(force)}"
    return curves_of(run, title, agreement(run.road_speed, run.speed))


def told(force: CruiseForce | None) -> str:
    """Error of a force in cruise in words."""
    if force is None:
        return "the gateway ended the run"
    share = 100.0 * force.mean_error / force.target
    return f"{force.mean_error:+.1f} N of {force.target:.0f} N ({share:+.1f} %)"
