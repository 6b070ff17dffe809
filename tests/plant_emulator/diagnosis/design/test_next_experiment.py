"""The next experiment, on machines of which the answer is known beforehand."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from plant_emulator import parameter_sets
from plant_emulator.diagnosis.answer import Location
from plant_emulator.diagnosis.decision.verdict import Decision
from plant_emulator.diagnosis.design.next_experiment import Advice
from plant_emulator.diagnosis.execution.pool import InProcess, TaskRunner
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.explanation import Explanation, Hypothesis
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.machine import Candidate, MeasuredRun
from plant_emulator.diagnosis.machines.bench import BenchRecipe
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.input_noise import NoiseDirections
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Array
from plant_emulator.workflows.simulation import simulate

N = 400
SLOW = np.linspace(0.0, 1.0, N)
SLOWER = np.linspace(0.0, 0.9, N)
FAST = np.linspace(0.0, 2.0, N)

# Alike up to the speed of 1, above which one goes on straight: only a fast run tells them apart.
LAWS: dict[str, Callable[[Array], Array]] = {
    "square": lambda x: x**2,
    "straight": lambda x: np.where(x < 1.0, x**2, 2.0 * x - 1.0),
    "line": lambda x: x,
    "above": lambda x: np.where(x < 1.5, 0.0, 100.0 * (x - 1.5)),
}
NEEDS = {"square": "a speed above 1", "straight": "", "line": "", "above": "a speed above 1.5"}


def linear(name: str, std: float | None = None) -> Unknown:
    """An unknown on a linear scale."""
    return Unknown(name=name, start=0.0, lower=-1e3, upper=1e3, logarithmic=False, std=std)


def effect(name: str) -> Candidate:
    """An effect with one size, plausible at 1."""
    return Candidate(
        name=name,
        subsystem="road",
        sizes=(replace(linear(f"{name}_size"), start=1.0),),
        shapes=(),
        states=(),
        neutral={f"{name}_size": 0.0},
        fixed={},
        units={f"{name}_size": "1"},
        title=f"the {name}",
        needs=NEEDS[name],
    )


class Slope:
    """y = b x + effects over a speed x, noise 0.01; foretells runs at other speeds."""

    parameters = (linear("b", std=100.0),)
    units: Mapping[str, str] = {"b": "1"}
    subsystems: Mapping[str, str] = {"b": "road"}
    states: tuple[Unknown, ...] = ()

    def __init__(
        self,
        speeds: Sequence[Array],
        measured: Sequence[Array],
        plans: Mapping[str, Array],
        sources: Sequence[str] = (),
    ) -> None:
        self.speeds, self.measured, self.plans = list(speeds), list(measured), plans
        self.candidates = {name: effect(name) for name in LAWS}
        sources = sources or [f"run {k}" for k in range(len(speeds))]
        self.runs = [
            MeasuredRun(
                source=source,
                channels=("y",),
                units=("1",),
                time=x,
                measured=y[None, :],
                noise=np.array([0.01]),
                noise_ratio=np.ones((1, len(x))),
            )
            for source, x, y in zip(sources, speeds, measured, strict=True)
        ]

    def foretold(self, x: Array, effects: Sequence[str], v: Mapping[str, float]) -> Array:
        return v["b"] * x + sum(v[f"{name}_size"] * LAWS[name](x) for name in effects)

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        x, y = self.speeds[run], self.measured[run]
        return lambda v: ((y - self.foretold(x, effects, v)) / 0.01)[None, :]

    def observer(self, interval: float) -> "Slope":
        """See `Model`."""
        return self

    def input_noise(
        self, run: int, where: FitResult, state: Mapping[str, float]
    ) -> NoiseDirections | None:
        return None

    def course(self, run: int, effects: Sequence[str], values: Any) -> None:
        """See `Model`."""

    def nominal(self, runs: Sequence[int]) -> dict[str, float]:
        return {u.name: u.prior for u in self.parameters}

    def start_values(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        return {"b": 0.0}, [{} for _ in runs]

    def initial_states(self, run: int, effects: Sequence[str], values: Any) -> dict[str, float]:
        return {}

    def locate(self, where: FitResult, runs: Sequence[int]) -> None:
        """See `Model`."""

    def with_planned_runs(self, where: FitResult, runs: Sequence[int]) -> "Slope":
        more = [self.foretold(x, where.effects, where.values) for x in self.plans.values()]
        return Slope(
            [*self.speeds, *self.plans.values()],
            [*self.measured, *more],
            {},
            [*(run.source for run in self.runs), *self.plans],
        )

    def missing_experiments(self, runs: Sequence[int]) -> dict[str, tuple[str, ...]]:
        return {"road": ("a hill",)}


# Identities are used again once a model is gone; numbers are not.
NUMBERS = itertools.count()


class Given:
    """A recipe of a model that is there already."""

    def __init__(self, model: Slope) -> None:
        self.model, self.number = model, next(NUMBERS)

    def build(self) -> Slope:
        return self.model

    def digest(self) -> str:
        return str(self.number)


def measured(x: Array, y: Array) -> Array:
    """With noise of 0.01."""
    return y + 0.01 * np.random.default_rng(0).standard_normal(len(x))


def machine(**plans: Array) -> Slope:
    return Slope([SLOW], [measured(SLOW, 3.0 * SLOW + SLOW**2)], plans)


def explanation(model: Slope) -> Explanation:
    """`square` is accepted, `straight` cannot be told from it."""
    null = fit_null(model, (0,))
    points = {
        name: fit(model, (name,), (0,), null.values, null.states) for name in ("square", "straight")
    }
    hypotheses = [
        Hypothesis(effect=name, orthogonal_norm=0.0, total_norm=0.0, confounded_with="b", fit=point)
        for name, point in points.items()
    ]
    costs = {name: points[name].cost for name in ("square", "straight")}
    return Explanation(
        null=null,
        final=points["square"],
        hypotheses=tuple(hypotheses),
        alternatives={"square": costs},
        unconverged="",
        log_odds=0.0,
    )


ROAD = Location(subsystem="road", channel=None, phase="deceleration", shares={}, cells=())


def advice(model: Slope, explained: Explanation, kind: Any, hidden: Sequence[str] = ()) -> Any:
    found = Decision(kind=kind, effects=explained.final.effects, deviations=(), reason="")
    asked = Advice(runner=TaskRunner(pool=InProcess(), recipe=Given(model), model=model, runs=(0,)))
    return asked.next_experiment(explained, found, ROAD, hidden)


def cannot_follow(planned: Array) -> float:
    """By least squares alone: what b and `straight` leave of b and `square`, over both runs."""
    x = np.concatenate([SLOW, planned])
    columns = np.stack([x, LAWS["straight"](x)], axis=1)
    wanted = 3.0 * x + x**2
    return float(np.linalg.norm(wanted - columns @ np.linalg.lstsq(columns, wanted)[0]) / 0.01)


def test_effects_that_differ_above_a_speed_are_sent_to_the_run_that_reaches_it():
    brisk = np.linspace(0.0, 1.4, N)
    model = machine(slower=SLOWER, brisk=brisk)
    told = advice(model, explanation(model), "effect")
    assert told.startswith("Drive brisk: there square differs from straight by ")
    by = float(told.split(" by ")[1].split()[0])
    assert by == pytest.approx(cannot_follow(brisk), abs=1.0)


def test_cheaper_run_that_separates_clearly_is_preferred():
    model = machine(fast=FAST, faster=2.0 * FAST)
    assert advice(model, explanation(model), "effect").startswith("Drive fast:")


def test_where_no_run_separates_the_effects_own_needs_are_told():
    model = machine(slower=SLOWER)
    assert advice(model, explanation(model), "effect") == (
        "No drive program tells square from straight; what would: a speed above 1."
    )


def test_machine_without_planned_runs_tells_what_the_effects_need():
    model = machine()
    assert advice(model, explanation(model), "effect") == (
        "What would tell square from straight: a speed above 1."
    )


def test_effect_that_stands_alone_asks_for_nothing():
    model = machine(fast=FAST)
    alone = replace(explanation(model), alternatives={"square": {"square": 0.0}})
    assert advice(model, alone, "effect") is None


def test_run_that_shows_what_these_logs_cannot_is_named_with_it():
    model = machine(slower=SLOWER, fast=FAST)
    assert advice(model, explanation(model), "none", ["above"]) == (
        "Drive fast: it would show above, which these logs could not."
    )
    assert advice(model, explanation(model), "none", ["above", "straight"]) == (
        "Drive fast: it would show 2 of the 2 effects that these logs could not: above, straight."
    )
    assert advice(model, explanation(model), "none") is None
    model = machine(slower=SLOWER)
    assert advice(model, explanation(model), "parameter", ["above"]) == (
        "To see what these logs could not show: a speed above 1.5."
    )


def test_run_in_which_parameters_follow_an_effect_does_not_show_it():
    model = machine(fast=FAST)
    assert advice(model, explanation(model), "none", ["line"]) is None


def test_unknown_cause_is_narrowed_down_where_it_lies():
    model = machine(slower=SLOWER, fast=FAST)
    assert advice(model, explanation(model), "unknown") == (
        "To narrow it down in the road: drive fast; brake at several rates; "
        "add what these logs lack: a hill."
    )


def test_place_is_asked_for_by_the_cheaper_of_two_runs_that_show_nearly_as_much():
    model = machine(fast=FAST, faster=1.02 * FAST)
    assert "drive fast;" in advice(model, explanation(model), "unknown")
    model = machine(fast=FAST, far=5.0 * FAST)
    assert "drive far;" in advice(model, explanation(model), "unknown")


def test_fit_that_did_not_converge_is_sent_to_the_run_that_determines_most():
    model = machine(slower=SLOWER, fast=FAST)
    stuck = replace(explanation(model), unconverged="the last fit did not converge")
    assert advice(model, stuck, "unknown") == "To steady the fit: drive fast."
    model = machine()
    assert "another run" in advice(model, stuck, "unknown")


@pytest.mark.slow
def test_bench_names_the_program_that_has_what_an_effect_needs():
    """A truck's wheel needs a truck, a wound-up controller the jump in program 4's reference."""
    given = parameter_sets.load("thesis_table_3_1")
    logs = [simulate(f"program{k}", parameters=given, seed=k) for k in (1, 2, 3)]
    recipe = BenchRecipe(tuple(recording(log) for log in logs), given)
    model = recipe.build()
    null = FitResult(
        effects=(),
        values={u.name: u.prior for u in model.parameters},
        states=({GAP_POSITION: 0.0},) * 3,
        cost=0.0,
        sum_of_squares=0.0,
        samples=1,
        effective_fraction=1.0,
        standard_errors={},
        converged=True,
    )
    explained = Explanation(
        null=null, final=null, hypotheses=(), alternatives={}, unconverged="", log_odds=0.0
    )
    nothing = Decision(kind="none", effects=(), deviations=(), reason="")
    asked = Advice(runner=TaskRunner(pool=InProcess(), recipe=recipe, model=model, runs=(0, 1, 2)))
    for hidden, program in (("wheel_slip", "program6"), ("integrator_windup", "program4 (60 s")):
        told = asked.next_experiment(explained, nothing, ROAD, [hidden])
        assert told is not None
        assert told.startswith(f"Drive {program}")
        assert hidden in told
