"""A machine so small that its diagnosis can be checked by hand: a line with effects."""

import itertools
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from plant_emulator.diagnosis.execution.pool import InProcess, Pool, TaskRunner
from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.fitting.explanation import Explanation
from plant_emulator.diagnosis.machine import Candidate, Course, MeasuredRun
from plant_emulator.diagnosis.search.search import Search
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.recordings.input_noise import NoiseDirections
from plant_emulator.signals.log import Array

TIME = np.linspace(-1.0, 1.0, 2000)


def linear(name: str, start: float = 1.0, **more: float) -> Unknown:
    """An unknown on a linear scale."""
    return Unknown(name=name, start=start, lower=-50.0, upper=50.0, logarithmic=False, **more)  # type: ignore[arg-type]


def effect(name: str, size: float = 1.0) -> Candidate:
    """An effect with one size."""
    return Candidate(
        name=name,
        subsystem=f"part of {name}",
        sizes=(linear(f"{name}_size", size, scale=size),),
        shapes=(),
        states=(),
        neutral={f"{name}_size": 0.0},
        fixed={},
        units={f"{name}_size": "1"},
        title=f"The {name}",
    )


SHAPES: dict[str, Callable[[Array], Array]] = {
    "cube": lambda x: x**3,
    "wave": lambda x: np.sin(20.0 * x),
    "kink": np.abs,
    "near kink": lambda x: np.abs(x) + 1e-3 * np.sin(9.0 * x),
}


class Line:
    """y = a + b x + effects, noise 1: linear, so that every step has a closed form."""

    parameters = (linear("a", 0.0, std=10.0), linear("b", 0.0, std=10.0))
    units: Mapping[str, str] = {"a": "1", "b": "1"}
    subsystems: Mapping[str, str] = {"a": "level", "b": "slope"}
    states: tuple[Unknown, ...] = ()

    def __init__(self, measured: Sequence[Array], names: Sequence[str] = tuple(SHAPES)) -> None:
        self.measured = list(measured)
        self.candidates = {name: effect(name) for name in names}
        self.runs = [
            MeasuredRun(
                source=f"run {k}",
                channels=("y",),
                units=("1",),
                time=TIME,
                measured=y[None, :],
                noise=np.ones(1),
                noise_ratio=np.ones((1, len(TIME))),
            )
            for k, y in enumerate(measured)
        ]

    def residual(self, run: int, effects: Sequence[str]) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`."""

        def residual(v: Mapping[str, float]) -> Array:
            y = v["a"] + v["b"] * TIME
            for name in effects:
                y = y + v[f"{name}_size"] * SHAPES[name](TIME)
            return (self.measured[run] - y)[None, :]

        return residual

    def observer(self, interval: float) -> "Line":
        """See `Model`: a line has nothing to lead it along."""
        return self

    def input_noise(
        self, run: int, where: FitResult, state: Mapping[str, float]
    ) -> NoiseDirections | None:
        """See `Model`: nothing is fed."""
        return None

    def course(self, run: int, effects: Sequence[str], values: Mapping[str, float]) -> Course:
        """See `Model`: a line does not turn."""
        residual = self.residual(run, effects)(values)
        return Course(channels=self.measured[run] - residual, turns=None)

    def nominal(self, runs: Sequence[int]) -> dict[str, float]:
        """See `Model`."""
        return {u.name: u.prior for u in self.parameters}

    def start_values(self, runs: Sequence[int]) -> tuple[dict[str, float], list[dict[str, float]]]:
        """See `Model`."""
        return {"a": 0.0, "b": 0.0}, [{} for _ in runs]

    def initial_states(
        self, run: int, effects: Sequence[str], values: Mapping[str, float]
    ) -> dict[str, float]:
        """See `Model`."""
        return {}

    def unwhitened_residual(
        self, run: int, effects: Sequence[str]
    ) -> Callable[[Mapping[str, float]], Array]:
        """See `Model`: the noise is white."""
        return self.residual(run, effects)

    def relations(self, where: FitResult, runs: Sequence[int], whiteners: object = None) -> None:
        """See `Model`: there are none."""

    def locate(self, where: FitResult, runs: Sequence[int]) -> None:
        """See `Model`."""


# Identities are used again once a model is gone; numbers are not.
NUMBERS = itertools.count()


class Given:
    """A recipe of a model that is there already."""

    def __init__(self, model: Line) -> None:
        self.model, self.number = model, next(NUMBERS)

    def build(self) -> Line:
        """The model."""
        return self.model

    def digest(self) -> str:
        """Its number, that no other recipe has."""
        return str(self.number)


def runner(model: Line, pool: Pool | None = None) -> TaskRunner:
    """All runs of a model, fitted in this process."""
    runs = tuple(range(len(model.runs)))
    return TaskRunner(pool=pool or InProcess(), recipe=Given(model), model=model, runs=runs)


def noisy(y: Array, seed: int = 0) -> Array:
    """With noise of 1."""
    return y + np.random.default_rng(seed).standard_normal(len(TIME))


def explained(model: Line) -> Explanation:
    """The search over all runs."""
    there = runner(model)
    return Search(declared=there, runner=there, null=fit_null(model, there.runs)).explain()
