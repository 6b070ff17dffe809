"""What a machine in outline leaves, and effects in the field's own terms, checked by hand."""

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.derived_quantities import derived_quantities
from plant_emulator.diagnosis.fitting.joint_fit import fit
from plant_emulator.diagnosis.machines.axis import AxisModel
from plant_emulator.diagnosis.prediction.remainder import (
    describe_band,
    describe_fall,
    unmodelled_remainder,
)
from plant_emulator.diagnosis.prediction.trace import Trace
from tests.plant_emulator.diagnosis import axis_truth
from tests.plant_emulator.diagnosis.axis_truth import Array

STEP = 0.01
TIME = STEP * np.arange(6000)
SIZE = 100.0


@pytest.fixture(scope="module")
def axis() -> AxisModel:
    return AxisModel([axis_truth.log(seed=1), axis_truth.log(phase=1.0, seed=2)], fitted=(0,))


@pytest.fixture(scope="module")
def nominal(axis: AxisModel) -> FitResult:
    return fit(axis, (), (0,), axis.start_values((0,))[0], [{}])


def trace(before: Array, after: Array, source: str = "held out") -> Trace:
    measured = SIZE * np.sin(2.0 * np.pi * 0.5 * TIME)
    return Trace(
        source=source,
        channel="force",
        unit="N",
        time=TIME,
        measured=measured,
        recalibrated=measured - before,
        explained=measured - after,
        noise=0.1,
    )


def wave(size: float, frequency: float) -> Array:
    return size * np.sin(2.0 * np.pi * frequency * TIME)


def test_relative_error_of_sines_is_the_ratio_of_their_sizes(
    axis: AxisModel, nominal: FitResult
) -> None:
    rest = unmodelled_remainder(axis, nominal, (0,), [trace(wave(6.0, 1.0), wave(5.0, 27.0))])
    assert (rest.before, rest.after) == pytest.approx((0.06, 0.05), rel=1e-6)
    assert "falls from 6.00 % to 5.00 %" in describe_fall(rest)


def test_relative_error_leaves_out_the_samples_that_do_not_count(
    axis: AxisModel, nominal: FitResult
) -> None:
    """At rest for a third of the run, held by a force of ten times the motion's."""
    whole = trace(wave(6.0, 1.0), wave(5.0, 27.0))
    held = TIME >= 40.0
    rests = replace(
        whole,
        measured=np.where(held, 10.0 * SIZE, whole.measured),
        recalibrated=np.where(held, np.nan, whole.recalibrated),
        explained=np.where(held, np.nan, whole.explained),
    )
    rest = unmodelled_remainder(axis, nominal, (0,), [rests])
    assert (rest.before, rest.after) == pytest.approx((0.06, 0.05), rel=1e-6)
    assert rest.band == (20.0, 35.0)


@pytest.mark.parametrize(
    ("frequency", "told"),
    [(27.0, "20 to 35 Hz: elasticity, or unknown"), (1.1, "0.2 to 2 Hz: unknown")],
)
def test_rest_lies_in_the_band_of_its_frequency(
    axis: AxisModel, nominal: FitResult, frequency: float, told: str
) -> None:
    rest = unmodelled_remainder(axis, nominal, (0,), [trace(wave(6.0, 1.0), wave(5.0, frequency))])
    assert describe_band(rest).endswith(told)
    # Half the square of its size, whatever the band's width.
    assert rest.held_out.max() == pytest.approx(12.5, rel=0.1)


def test_what_fitted_runs_leave_too_is_not_where_the_rest_lies(
    axis: AxisModel, nominal: FitResult
) -> None:
    # Without Coulomb friction the fitted run leaves 25 N that turn with the motion: 625 N^2.
    off = FitResult(**{**vars(nominal), "values": {**nominal.values, "coulomb_friction": 0.0}})
    rest = unmodelled_remainder(
        axis, off, (0,), [trace(wave(9.0, 1.0), wave(25.0, 1.0) + wave(20.0, 15.0))]
    )
    assert rest.fitted is not None
    assert rest.fitted[0] > rest.held_out[0] > rest.held_out[3]
    assert rest.band == (10.0, 20.0)


def test_runs_held_out_in_turn_are_compared_with_nothing(
    axis: AxisModel, nominal: FitResult
) -> None:
    rest = unmodelled_remainder(
        axis, nominal, (0,), [trace(wave(6.0, 1.0), wave(5.0, 27.0), source="axis 1")]
    )
    assert rest.fitted is None


def test_coefficients_by_direction_are_those_of_a_fit_of_both() -> None:
    log = axis_truth.log(lambda _q, v, _a: 0.2 * axis_truth.VISCOUS * np.abs(v))
    model = AxisModel([log, axis_truth.log(phase=1.0, seed=2)], fitted=(0,))
    start = {**model.start_values((0,))[0], "viscous_asymmetry_ratio": 0.1}
    found = fit(model, ("viscous_asymmetry",), (0,), start, [{}])
    terms = {t.name: t for t in derived_quantities(model, found, (0,))["viscous_asymmetry"]}
    for name, truth in {"forwards": 1.2, "backwards": 0.8}.items():
        value, error = terms[name].value, terms[name].standard_error
        assert value == pytest.approx(truth * axis_truth.VISCOUS, rel=0.01)
        assert abs(value - truth * axis_truth.VISCOUS) < 4.0 * error
        # Of the mean of both and of half their difference, neither alone.
        both = (
            found.standard_errors["viscous_friction"],
            found.standard_errors["viscous_asymmetry_ratio"],
        )
        rough = float(np.hypot(both[0] * truth, both[1] * axis_truth.VISCOUS))
        assert 0.3 * rough < error < 1.5 * rough


def test_effect_without_terms_of_its_own_has_none(axis: AxisModel, nominal: FitResult) -> None:
    assert derived_quantities(axis, nominal, (0,)) == {}
