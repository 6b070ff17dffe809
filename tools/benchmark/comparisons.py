"""The comparisons of tools/bench.py: the emulator with general solvers and with its budgets."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from benchmark import clients, diagnoses, peers, ticks
from benchmark.fits import Fits, Fitted
from benchmark.study import ERROR_BOUND, LONG_STEP, PROGRAM, Study
from benchmark.timing import alone, duration, side_by_side
from plant_emulator import parameter_sets
from plant_emulator.effects import names as effect_names
from plant_emulator.simulation.running_bench import Bench
from plant_emulator.simulation.simulate import LARGEST_STEP, simulate
from plant_emulator.solver import kernel

if TYPE_CHECKING:
    from plant_emulator.signals.log import Array

# Tolerance of the independent solver that has to agree with our converged solution.
INDEPENDENT = 1e-6
FIXED_STEP = 1e-3
SCAN = 10
TICK_BUDGET = 50e-6
WAKE_UP = 1e-3
# Slowest read and write of the gateway over those of libmodbus in C.
SLOWEST_CLIENT = 2.2
MANY = 1000
DIAGNOSIS_BUDGET = 60.0
FIRST_RESULT = """
import sys
from plant_emulator import parameter_sets
from plant_emulator.simulation import programs
from plant_emulator.signals.log import Log
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import simulate
time, reference = programs.PROGRAMS[sys.argv[1]].reference()
simulate(inputs_of(Log(time, {"speed_reference": reference})), parameter_sets.load().values())
"""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One comparison; an error is the NRMSD of the worst channel [%], None where there is none."""

    name: str
    ours: float | None
    peer: str
    peers: float | None
    unit: str = "s"
    ratio: float | None
    target: float
    holds: bool
    ours_error: float | None = None
    peers_error: float | None = None


def row(name: str, ours: float, peer: str, their: float, target: float, **more: object) -> Row:
    """The row of two figures."""
    ratio = their / ours
    return Row(
        name=name,
        ours=ours,
        peer=peer,
        peers=their,
        ratio=ratio,
        target=target,
        holds=ratio >= target,
        **more,  # type: ignore[arg-type]
    )


def missing(name: str, peer: str, target: float) -> Row:
    """The row of a peer that is not installed."""
    return Row(name=name, ours=None, peer=peer, peers=None, ratio=None, target=target, holds=False)


Rows = Iterator[Row]


def compare(
    study: Study, name: str, peer: str, solve: Callable[[float], Array], target: float
) -> Rows:
    """Compare the kernel, then `simulate`, with a general solver at the same error."""
    tolerance, error = study.ours
    theirs, their_error = study.fastest(solve)
    label = f"{peer}, rtol {theirs:g}"
    ways = {
        name: study.raw(kernel.plain_kernel(), tolerance),
        f"{name}_simulate": lambda: study.simulate(tolerance),
    }
    for key, action in ways.items():
        times = side_by_side(action, lambda: solve(theirs))
        yield row(key, times[0], label, times[1], target, ours_error=error, peers_error=their_error)


def reference(study: Study) -> Rows:
    """The difference between our converged solution and that of an independent solver."""
    solve = peers.Lsoda(study.time, peers.tuned(study.corners, study.values), study.values)
    apart = study.error(solve(INDEPENDENT))
    label = f"difference from LSODA at {INDEPENDENT:g}; a tenth of the error bound"
    yield row("reference", apart, label, 0.1 * ERROR_BOUND, 1.0, unit="%")


def lsoda(study: Study) -> Rows:
    """scipy's LSODA with a right-hand side as one writes it."""
    solve = peers.Lsoda(study.time, peers.plain(study.corners, study.values), study.values)
    yield from compare(study, "lsoda", "scipy LSODA, right-hand side in Python", solve, 80.0)


def lsoda_tuned(study: Study) -> Rows:
    """scipy's LSODA with a right-hand side as fast as Python gets."""
    solve = peers.Lsoda(study.time, peers.tuned(study.corners, study.values), study.values)
    yield from compare(study, "lsoda_tuned", "scipy LSODA, the same tuned by hand", solve, 80.0)


def cvodes(study: Study) -> Rows:
    """CVODES of CasADi, where CasADi is installed."""
    try:
        import casadi  # noqa: F401 - only whether it is there
    except ImportError as error:
        click.echo(f"cvodes: {error}; pip install 'road-load-bench[bench]' brings it", err=True)
        yield missing("cvodes", "CasADi CVODES: not installed", 8.0)
        return
    solve = peers.Cvodes(study.time, study.corners, study.values)
    yield from compare(study, "cvodes", "CasADi CVODES", solve, 8.0)


def realtime(study: Study) -> Rows:
    """Simulated time over processor time, with adaptive and with fixed steps."""
    tolerance, error = study.ours
    model = kernel.plain_kernel()
    adaptive = alone(study.raw(model, tolerance))
    yield row("realtime_adaptive", adaptive, "real time", study.duration, 1e4, ours_error=error)
    landing = alone(study.raw(model, tolerance, LARGEST_STEP))
    label = "real time, no step longer than a sample"
    yield row("realtime_landing", landing, label, study.duration, 1e4)
    fixed = alone(study.raw(model, inf, FIXED_STEP))
    yield row("realtime_fixed", fixed, f"real time, {FIXED_STEP:g} s", study.duration, 2e3)


def tick(_: Study) -> Rows:
    """One call of the running bench: a single step, and the steps of one PLC scan."""
    bench = Bench(parameter_sets.load())
    for steps in (1, SCAN):
        time = alone(lambda steps=steps: bench.advance([100.0] * steps))  # type: ignore[misc]
        yield row(f"tick_{steps}", time, f"budget of {steps} ms of bench", TICK_BUDGET, 1.0)


def effects(study: Study) -> Rows:
    """The cost of all effects at their neutral values, and of some of them."""
    tolerance, _ = study.ours
    every, none = kernel.kernel(), kernel.build({})
    times = side_by_side(
        study.raw(every, tolerance, LARGEST_STEP), study.raw(none, tolerance, LARGEST_STEP)
    )
    yield row("effects", times[0], "the kernel without effects", times[1], 0.5)
    for name, remembering in {"with_memories": True, "without_memories": False}.items():
        some = kernel.partial_kernel(remembering=remembering)
        times = side_by_side(
            study.raw(some, tolerance, LARGEST_STEP), study.raw(every, tolerance, LARGEST_STEP)
        )
        yield row(f"effects_{name}", times[0], "the kernel with all effects", times[1], 1.1)


def thousand(study: Study) -> Rows:
    """A thousand simulations with different parameters."""
    random, (tolerance, _) = np.random.default_rng(1), study.ours

    def action() -> None:
        inertia, gain = study.values["drum_inertia"], study.values["speed_gain"]
        for share in random.uniform(0.9, 1.1, MANY):
            changed = {"drum_inertia": share * inertia, "speed_gain": gain / share}
            simulate(
                study.run, {**study.values, **changed}, tolerance=tolerance, largest_step=LONG_STEP
            )

    yield row("thousand", alone(action, 1), f"real time of {MANY} runs", MANY * study.duration, 0.0)


def first_result(study: Study) -> Rows:
    """A new process up to its first result, without and with compiled kernels on the disk."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("first_result_cold", "first_result_warm"):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            environment = {**os.environ, "ROADLOAD_CACHE": folder}
            root = Path(__file__).resolve().parents[2]
            subprocess.run(
                [sys.executable, "-c", FIRST_RESULT, PROGRAM], env=environment, cwd=root, check=True
            )
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            yield row(name, used, "real time of the run", study.duration, 0.0)


def identification(_: Study) -> Rows:
    """A fit of nine parameters and an initial state to one log, from the nominal parameters."""
    try:
        import lmfit  # noqa: F401 - only whether it is there
    except ImportError as error:
        click.echo(f"identification: {error}; pip install 'road-load-bench[bench]'", err=True)
        yield missing("identification", "lmfit on scipy LSODA: not installed", 100.0)
        return
    fits = Fits()
    ours = fits.ours()
    before = duration(fits.ours, 3)
    theirs: list[Fitted] = []
    peer = duration(lambda: theirs.append(fits.lmfit()), 1)
    mine = 0.5 * (before + duration(fits.ours, 3))
    costs = f"sum of squares {ours.estimate.cost:.1f}, its {theirs[0].cost:.1f}"
    yield row("identification", mine, f"lmfit on scipy LSODA; ours {costs}", peer, 100.0)


def diagnosis(_: Study) -> Rows:
    """A diagnosis of programs 1 to 3 with the whole library; its growth with logs and effects."""
    every = len(effect_names())
    few = diagnoses.SMALL
    diagnoses.diagnose(1, few)  # compiles what is not in the cache yet
    whole = diagnoses.diagnose(3, every)
    label = f"budget of wall time; here {diagnoses.cores()}"
    yield row("diagnosis", whole.clock, label, DIAGNOSIS_BUDGET, 1.0)
    yield row("diagnosis_processor", whole.processors, "its wall time", whole.clock, 0.0)
    fewer = [(logs, every) for logs in (1, 2)] + [(3, count) for count in (few, 2 * few)]
    for logs, count in fewer:
        cost = diagnoses.diagnose(logs, count)
        label = f"3 logs, {every} effects; processor time of both"
        yield row(f"logs_{logs}_effects_{count}", cost.processors, label, whole.processors, 0.0)


def gateway(_: Study) -> Rows:
    """The gateway's tick: 99 % of all wake-ups are late by less than WAKE_UP, whatever runs beside.

    The latency contains the emulator's reply, for which a busy machine has to find a processor.
    Before that, one read and one write over the gateway's link beside libmodbus.
    """
    name, peer, target = (
        "gateway_client",
        "libmodbus in C, same PLC: median of a cycle",
        SLOWEST_CLIENT,
    )
    try:
        ours, theirs = clients.measure()
        yield row(name, ours, peer, theirs, 1.0 / target)
    except clients.NoPeerError as error:
        yield missing(name, f"libmodbus in C: {error}", 1.0 / target)
    for name, beside in (
        ("gateway", ()),
        ("gateway_busy", ("busy",)),
        ("gateway_metrics", ("metrics",)),
        ("gateway_both", ("busy", "metrics")),
        ("gateway_stalled", ("stalled",)),
    ):
        for part, found in ticks.measure(*beside).items():
            p50, p99, longest = ticks.quantiles(found)
            label = f"p99; p50 {1e3 * p50:.2f} ms, max {1e3 * longest:.2f} ms"
            target = 1.0 if part == "lateness" else 0.0
            yield row(f"{name}_{part}", p99, label, WAKE_UP, target)


GROUPS = {
    group.__name__: group
    for group in (
        reference,
        lsoda,
        lsoda_tuned,
        cvodes,
        realtime,
        tick,
        effects,
        identification,
        diagnosis,
        thousand,
        first_result,
        gateway,
    )
}
