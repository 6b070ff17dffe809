"""Two real axes whose data may not be copied: they are read from where REAL_DATA says.

EMPS: A. Janot, M. Gautier, M. Brunot, "Data set and reference models of EMPS", Workshop on
Nonlinear System Identification Benchmarks, 2019; figures from its description. HSM150: a bench of
two motors, three repeats of four torque steps (github.com/malik-robert/HSM150-data).
"""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.joint_fit import fit_null, linearise
from plant_emulator.diagnosis.fitting.looks import glance, look
from plant_emulator.diagnosis.fitting.nuisance_space import NuisanceSpace
from plant_emulator.diagnosis.fitting.signature import signature
from plant_emulator.diagnosis.machines.axis import AxisModel
from plant_emulator.estimation.least_squares import estimate
from plant_emulator.signals.frequency_bands import BANDS, power
from plant_emulator.workflows import axis_reader

ROOT = Path(__file__).parents[3]
DATA = ROOT / os.environ.get("REAL_DATA", "../shared/data")
EMPS, HSM150 = DATA / "emps", DATA / "hsm150"
FIRST, PULSES = 0, 1
COUNTS = 25.0
"""Evidence from which on an effect counts."""

needs_emps = pytest.mark.skipif(not EMPS.is_dir(), reason=f"{EMPS}: no data; set REAL_DATA")
needs_hsm150 = pytest.mark.skipif(not HSM150.is_dir(), reason=f"{HSM150}: no data; set REAL_DATA")

Contest = tuple[FitResult, dict[str, FitResult]]


def contest(model: AxisModel, runs: tuple[int, ...], base: FitResult | None = None) -> Contest:
    """A fit, and the joint fits of every further effect that shows at all."""
    base = base or fit_null(model, runs)
    tangents = NuisanceSpace(linearise(model, base, runs))
    others = (name for name in model.candidates if name not in base.effects)
    found = {name: signature(model, name, base, runs, tangents) for name in others}
    return base, {
        name: look(
            model, (*base.effects, name), runs, glance(model, one, base, runs, tangents.estimate)
        )
        for name, one in found.items()
        if one is not None
    }


def evidence(base: FitResult, found: dict[str, FitResult], share: float) -> dict[str, float]:
    """Fall of the cost in units of what the best model leaves, in independent samples."""
    left = max(1.0, min(point.mean_square for point in (base, *found.values())))
    return {name: (base.cost - point.cost) / left * share for name, point in found.items()}


def relative_error(model: AxisModel, run: int, point: FitResult) -> float:
    """norm(e) / norm(y) in percent."""
    residual = model.residual(run, point.effects)(point.values) * model.runs[run].noise[0]
    return 100.0 * float(np.linalg.norm(residual) / np.linalg.norm(model.runs[run].measured))


@pytest.fixture(scope="module")
def emps() -> AxisModel:
    files = [EMPS / "DATA_EMPS.mat", EMPS / "DATA_EMPS_PULSES.mat"]
    return AxisModel([axis_reader.read(file) for file in files], fitted=(FIRST,))


@pytest.fixture(scope="module")
def emps_contest(emps: AxisModel) -> Contest:
    return contest(emps, (FIRST,))


@pytest.fixture(scope="module")
def hsm150() -> AxisModel:
    files = [file for n in "123" for file in sorted(HSM150.glob(f"idf_*_{n}.mat"))]
    return AxisModel([axis_reader.read(file) for file in files], fitted=tuple(range(8)))


@pytest.fixture(scope="module")
def hsm150_contest(hsm150: AxisModel) -> Contest:
    return contest(hsm150, tuple(range(8)))


@needs_emps
def test_emps_has_its_published_parameters_and_errors(
    emps: AxisModel, emps_contest: Contest
) -> None:
    null, _ = emps_contest
    published = {
        "inertia": 95.1089,
        "viscous_friction": 203.5034,
        "coulomb_friction": 20.3935,
        "offset": -3.1648,
    }
    for name, value in published.items():
        assert null.values[name] == pytest.approx(value, rel=0.01)
    assert relative_error(emps, FIRST, null) == pytest.approx(4.02, abs=0.1)
    assert relative_error(emps, PULSES, null) == pytest.approx(5.95, abs=0.1)


@needs_emps
def test_emps_has_the_published_viscous_friction_by_direction(
    emps: AxisModel, emps_contest: Contest
) -> None:
    point = emps_contest[1]["viscous_asymmetry"]
    viscous, ratio = point.values["viscous_friction"], point.values["viscous_asymmetry_ratio"]
    assert viscous * (1.0 + ratio) == pytest.approx(166.7, rel=0.01)
    assert viscous * (1.0 - ratio) == pytest.approx(240.4, rel=0.01)
    assert relative_error(emps, FIRST, point) == pytest.approx(3.03, abs=0.1)
    assert relative_error(emps, PULSES, point) == pytest.approx(5.34, abs=0.1)


@needs_emps
def test_emps_asks_for_viscous_friction_by_direction_and_nothing_else(
    emps_contest: Contest,
) -> None:
    null, found = emps_contest
    evident = evidence(null, found, null.effective_fraction)
    assert [name for name in evident if evident[name] > COUNTS] == ["viscous_asymmetry"]
    assert (
        evident["viscous_asymmetry"]
        - max(value for name, value in evident.items() if name != "viscous_asymmetry")
        > 10.0
    )


@needs_emps
def test_a_second_effect_of_emps_does_not_count_with_the_memory_of_the_first_fit(
    emps: AxisModel, emps_contest: Contest
) -> None:
    null, found = emps_contest
    base, more = contest(emps, (FIRST,), found["viscous_asymmetry"])
    evident = evidence(base, more, min(null.effective_fraction, base.effective_fraction))
    assert max(evident.values()) < COUNTS
    gains = {
        name: 1.0 - relative_error(emps, PULSES, point) / relative_error(emps, PULSES, base)
        for name, point in more.items()
    }
    for name in ("position_dependence", "load_dependence", "screw_ripple"):
        assert gains[name] < 0.005
    # one class: a root, a square or a cube of the speed
    assert 0.01 < gains["concave_friction"] < 0.02


@needs_emps
def test_what_the_pulses_leave_lies_above_20_hertz(emps: AxisModel, emps_contest: Contest) -> None:
    point = emps_contest[1]["viscous_asymmetry"]
    first, pulses = (
        power(
            (emps.residual(run, point.effects)(point.values) * emps.runs[run].noise[0])[0],
            float(np.diff(emps.runs[run].time).mean()),
        )
        for run in (FIRST, PULSES)
    )
    ratio = dict(zip(BANDS, pulses / first, strict=True))
    assert ratio[20.0, 35.0] == pytest.approx(5.0, abs=0.5)
    assert 12.0 < ratio[35.0, 45.0] < 16.0
    assert ratio[5.0, 10.0] == pytest.approx(1.0, abs=0.1)


@needs_emps
def test_pulses_are_in_the_command_already(emps: AxisModel, emps_contest: Contest) -> None:
    from scipy.io import loadmat

    found = loadmat(EMPS / "DATA_EMPS_PULSES.mat")
    log = axis_reader.read(EMPS / "DATA_EMPS_PULSES.mat")
    assert log.force == pytest.approx((found["vir"] * found["gtau"]).ravel())


@needs_hsm150
def test_repeats_of_hsm150_differ_by_friction_and_leave_nothing_but_noise(
    hsm150: AxisModel, hsm150_contest: Contest
) -> None:
    null, found = hsm150_contest
    assert null.mean_square < 1.1
    assert max(evidence(null, found, null.effective_fraction).values()) < COUNTS
    levels = [state["friction_level"] for state in null.states]
    assert max(levels) - min(levels) > 0.05
    for run in range(8, 12):
        assert float(np.mean(held_out(hsm150, run, null) ** 2)) < 1.2


def held_out(model: AxisModel, run: int, point: FitResult) -> np.ndarray:
    """Whitened residual of a run, all parameters kept, its own friction level fitted."""
    residual = model.residual(run, point.effects)
    own = [replace(unknown, run=0) for unknown in model.states]
    return estimate(own, [lambda state: residual({**point.values, **state})]).residuals[0]


@needs_hsm150
def test_hsm150_lies_among_its_published_parameters(hsm150_contest: Contest) -> None:
    # ranges over single runs; J 1.2e-4 kg m^2 and B 7.03e-5 N m s are the maker's
    null, _ = hsm150_contest
    assert 0.75e-4 < null.values["inertia"] < 1.34e-4
    assert 5.8e-5 < null.values["viscous_friction"] < 7.9e-5
    # 28 mN m in negative, 41 mN m in positive direction
    assert null.values["coulomb_friction"] == pytest.approx(34.5e-3, abs=1e-3)
    assert null.values["offset"] == pytest.approx(6.5e-3, abs=1e-3)
