"""A kernel with the library and the trial's own laws, for these tests only."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from plant_emulator.blind import laws
from plant_emulator.blind.case import Case, Hidden
from plant_emulator.blind.result import CaseResult
from plant_emulator.effects import Effect
from plant_emulator.solver import kernel as kernels


@cache
def own_laws() -> tuple[Effect, ...]:
    """The laws of the trial: always the same objects, hence one kernel."""
    return tuple(laws.load(name) for name in laws.names())


@pytest.fixture(scope="module", autouse=True)
def all_effects() -> Iterator[dict[str, Effect]]:
    """Effects of the library and laws of the trial, registered while a module is tested."""
    kernels.use_own_effects(*own_laws())
    yield dict(kernels.kernel().effects)
    kernels.use_own_effects()


def case_with(*hidden: Hidden, kind: str = "effect", runs: int = 1) -> Case:
    """A case of program 1 that hides these effects."""
    return Case(
        number=0,
        kind=kind,  # type: ignore[arg-type]
        programs=("program1",) * runs,
        hidden=hidden,
        parameters={},
        gaps=(0.3,) * runs,
        noise=1,
    )


def hidden(effect: str, subsystem: str, *, outside: bool = False, **values: float) -> Hidden:
    """A hidden effect with the library's own law."""
    return Hidden(
        effect=effect, law=effect, subsystem=subsystem, outside=outside, values=values,
        states=({},),
    )  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Path of a trial's folder."""
    return tmp_path / "trial"


def finished(number: int, *, right: bool) -> CaseResult:
    """The result of a case without effect; a wrong one is a false alarm."""
    return CaseResult(
        case=number + 1, kind="none", truth="none", hidden=(), programs=(), detectable=False,
        verdict="none" if right else "unknown", effects=(), classes=(), answered="none",
        evidence=3.0, confidence=None, right=right, top1=False, false_alarm=not right,
        subsystem=None, located=False, closed_fraction=None, closed_fraction_ci95=None,
        closed_fraction_true=None, sizes=(), seconds=1.0, log_odds=12.0,
    )  # fmt: skip
