"""A diagnosis of an axis of which everything is known."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.axis.diagnose import AxisRuns, diagnose_axis
from plant_emulator.diagnosis.diagnose import Findings
from plant_emulator.errors import LogError
from plant_emulator.signals.axis_log import AxisLog
from plant_emulator.workflows.diagnosis.plan import plan_of_runs
from tests.plant_emulator.diagnosis import axis_truth as truth

Extra = Callable[..., np.ndarray]
PLANTED: dict[str, tuple[Extra, str, float]] = {
    "viscous_asymmetry": (
        lambda q, v, a: 0.2 * truth.VISCOUS * np.abs(v),
        "forwards",
        1.2 * truth.VISCOUS,
    ),
    "stribeck": (
        lambda q, v, a: 20.0 * np.exp(-((v / 0.02) ** 2)) * np.sign(v),
        "stribeck_rise",
        20.0,
    ),
    "load_friction": (
        lambda q, v, a: 0.1 * truth.MASS * np.abs(a) * np.sign(v),
        "load_friction_ratio",
        0.1,
    ),
    "position_ripple": (
        lambda q, v, a: 3.0 * np.cos(2.0 * np.pi * q / 0.005),
        "position_ripple_cosine_1",
        3.0,
    ),
    "quadratic_drag": (lambda q, v, a: 300.0 * v * np.abs(v), "quadratic_drag_coefficient", 300.0),
}


def diagnosed(*logs: AxisLog, without: tuple[str, ...] = ()) -> Findings:
    """Diagnose the first log, the second held out."""
    return diagnose_axis(AxisRuns(logs, without), plan_of_runs(2, 1), settings={})


def pair(extra: Extra | None = None, *, late: float = 0.0) -> tuple[AxisLog, AxisLog]:
    return (
        truth.log(extra, force_late=late),
        truth.log(extra, phase=1.0, seed=2, force_late=late),
    )


@pytest.fixture(scope="module")
def nominal() -> Findings:
    return diagnosed(*pair())


@pytest.mark.slow
def test_an_axis_without_effects_has_none(nominal: Findings) -> None:
    assert nominal.answer.verdict.kind == "none"
    assert nominal.answer.verdict.effects == ()
    assert nominal.answer.location.subsystem is None


@pytest.mark.slow
def test_an_axis_without_effects_gives_its_parameters(nominal: Findings) -> None:
    expected = {
        "inertia": truth.MASS,
        "viscous_friction": truth.VISCOUS,
        "coulomb_friction": truth.COULOMB,
        "offset": truth.OFFSET,
    }
    for name, value in expected.items():
        found, error = nominal.final.values[name], nominal.final.standard_errors[name]
        assert found == pytest.approx(value, rel=0.01)
        assert abs(found - value) < 5.0 * error


@pytest.mark.slow
def test_what_is_left_is_the_noise_of_the_force(nominal: Findings) -> None:
    (trace,) = nominal.details.traces
    rms = float(np.sqrt(np.mean((trace.measured - trace.recalibrated) ** 2)))
    # Half a row around each reversal holds friction of either sign.
    assert rms == pytest.approx(trace.noise, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_effect_is_named_with_its_size(name: str) -> None:
    extra, key, size = PLANTED[name]
    found = diagnosed(*pair(extra))
    assert found.answer.verdict.effects == (name,)
    values = {q.name: q for q in found.answer.ranking[0].parameters}
    assert values[key].value == pytest.approx(size, rel=0.03)
    assert 0.0 < values[key].standard_error < 0.03 * size


@pytest.mark.slow
def test_a_delay_is_named_with_its_length() -> None:
    found = diagnosed(*pair(late=0.005))
    assert found.answer.verdict.effects == ("delay",)
    (time,) = found.answer.ranking[0].parameters
    assert time.value == pytest.approx(0.005, rel=0.03)


@pytest.mark.slow
def test_without_its_effect_the_cause_is_unknown() -> None:
    extra, _, _ = PLANTED["position_ripple"]
    found = diagnosed(*pair(extra), without=("position_ripple",))
    assert found.answer.verdict.kind in ("unknown", "none")
    assert found.answer.verdict.effects == ()


@pytest.mark.slow
def test_a_lag_does_not_stand_for_a_delay_that_the_library_lacks() -> None:
    found = diagnosed(*pair(late=0.005), without=("delay",))
    assert found.answer.verdict.kind == "unknown"
    assert "a law over the force before" in found.answer.verdict.statement


@pytest.mark.slow
def test_another_inertia_is_a_parameter() -> None:
    heavier = truth.log(lambda q, v, a: 0.3 * truth.MASS * a, phase=1.0, seed=2)
    found = diagnosed(truth.log(), heavier)
    assert found.answer.verdict.kind == "parameter"
    (shift,) = found.answer.verdict.parameters
    assert (shift.name, shift.unit) == ("inertia", "kg")
    assert shift.nominal == pytest.approx(truth.MASS, rel=0.01)
    assert shift.estimated == pytest.approx(1.3 * truth.MASS, rel=0.01)


@pytest.mark.slow
def test_a_load_that_is_not_logged_is_asked_for() -> None:
    load = 30.0 * np.sin(np.arange(0.0, truth.LENGTH, truth.PERIOD) ** 2)
    found = diagnosed(*pair(lambda q, v, a: load))
    assert found.answer.verdict.kind == "unknown"
    assert "load_force_N" in (found.answer.verdict.next_experiment or "")


@pytest.mark.slow
def test_a_load_that_is_not_logged_is_no_noise_of_a_coarse_encoder() -> None:
    """Rows of a coarse encoder are wide: the load changes from row to row, as noise does."""
    found = diagnosed(*(coarse(seed) for seed in (1, 2)))
    assert found.answer.verdict.kind == "unknown"
    assert "load_force_N" in (found.answer.verdict.next_experiment or "")


def coarse(seed: int) -> AxisLog:
    """A run at 100 Hz with steps of 0.1 mm, and a load of four tones that is not logged."""
    time, phases = truth.motion()[0], np.random.default_rng(seed).uniform(0.0, 6.0, (4, 1))
    tones = 2.0 * np.pi * np.array([[3.0], [4.3], [5.1], [6.7]])
    load = 10.0 * np.sin(tones * time + phases).sum(axis=0)
    whole = truth.log(lambda q, v, a: load, phase=float(seed), seed=seed)
    steps = 1e-4 * np.round(whole.position[::10] / 1e-4)
    return replace(whole, time=whole.time[::10], position=steps, force=whole.force[::10])


def test_a_short_log_is_refused() -> None:
    whole = truth.log()
    short = AxisLog(
        time=whole.time[:50],
        position=whole.position[:50],
        force=whole.force[:50],
        rotary=False,
        source="short",
    )
    with pytest.raises(LogError, match="short: 50 samples; 100 or more are needed"):
        diagnosed(short, whole)


def test_logs_of_two_kinds_of_axes_are_refused() -> None:
    first, second = pair()
    turned = AxisLog(
        time=second.time, position=second.position, force=second.force, rotary=True, source="b"
    )
    with pytest.raises(LogError, match=r"b: rotary \(rad, N m\), while axis 1 is linear"):
        diagnosed(first, turned)
