"""The nominal bench and the logs of the independent one."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from plant_emulator import effects, logs, parameter_sets
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import Log
from plant_emulator.solver import compiler
from plant_emulator.solver.kernel import Kernel, build, use_own_effects

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture(scope="module", autouse=True)
def no_own_effects() -> None:
    """The kernels of a module's tests have the shipped effects only, whatever ran before."""
    use_own_effects()


@pytest.fixture(scope="session")
def nominal() -> ParameterSet:
    """Table 3.1 of the thesis."""
    return parameter_sets.load("thesis_table_3_1")


@pytest.fixture(scope="session")
def bench_log() -> Callable[[str], Log]:
    """Return a function: path below tests/data without .csv.gz -> the log."""

    @cache
    def read(name: str) -> Log:
        return logs.read(DATA / f"{name}.csv.gz")

    return read


NO_EFFECT = '''"""An effect for a test: x = y. Source: a test."""

from plant_emulator.effects import EffectParameter, Memory

SUBSYSTEM = "gear"
PARAMETERS = {
    "size": EffectParameter(
        neutral=0.0, lower=-1e9, upper=1e9, plausible=1.0, unit="1", meaning="k"
    )
}
'''


@pytest.fixture
def model_with(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Kernel]:
    """Return a function: laws of an effect `own` with the parameter `size` -> uncompiled kernel."""
    monkeypatch.setattr(compiler, "ENABLED", False)

    def built(laws: str) -> Kernel:
        path = tmp_path / "own.py"
        path.write_text(f"{NO_EFFECT}\n\n{laws}", encoding="utf-8")
        return build({"own": effects.from_file(path)})

    return built
