"""The friction law through steady stretches: known laws, and how often the intervals hold them."""

import numpy as np
import pytest

from gateway.friction.law import friction_torque
from gateway.losses.fit import fit
from gateway.losses.sections import LossesError, Section

SPEEDS = np.array([0.3, 0.7, 1.4, 2.3, 3.5, 4.8, 6.1, 7.5])
LAW = (35.989, 345.38, 0.4418)


def sections(torque, speeds=SPEEDS, error=0.01):
    return [
        Section(
            run="run",
            start=0.0,
            end=5.0,
            motor_speed=62.6 * omega,
            gear_speed=float(omega),
            shaft_torque=-one / 62.6,
            friction=float(one),
            standard_error=error,
        )
        for omega, one in zip(speeds, torque, strict=True)
    ]


def law(speeds=SPEEDS, values=LAW):
    coulomb, viscous, exponent = values
    return coulomb + viscous * speeds**exponent


@pytest.mark.parametrize("values", [LAW, (100.0, 50.0, 1.0), (5.0, 400.0, 0.2), (300.0, 2.0, 1.9)])
def test_the_law_of_exact_stretches_is_found_again(values):
    found = fit(sections(law(values=values)))
    friction = found.friction
    assert (friction.coulomb, friction.viscous, friction.exponent) == pytest.approx(
        values, rel=1e-4
    )
    assert found.torque(SPEEDS) == pytest.approx([friction_torque(w, friction) for w in SPEEDS])
    assert not found.held_at_zero


@pytest.mark.slow
def test_95_percent_intervals_hold_the_truth_90_to_99_percent_of_the_time():
    random, noise, repeats = np.random.default_rng(7), 1.0, 300
    held = np.zeros(4)
    for _ in range(repeats):
        torque = law() + noise * random.standard_normal(len(SPEEDS))
        found = fit(sections(torque, error=noise))
        friction = found.friction
        values = np.array([friction.coulomb, friction.viscous, friction.exponent])
        held[:3] += np.abs(values - LAW) < 1.96 * np.array(found.standard_errors)
        at = np.array([4.0])
        held[3] += abs(found.torque(at) - law(at))[0] < 1.96 * found.torque_error(at)[0]
    assert np.all((held / repeats > 0.90) & (held / repeats < 0.99))


def test_stretches_that_lie_off_the_law_widen_its_errors():
    off = law() + 5.0 * np.array([1, -1, 1, -1, 1, -1, 1, -1])
    assert fit(sections(off)).standard_errors[0] > 10.0 * fit(sections(law())).standard_errors[0]


def test_a_constant_part_below_zero_is_held_at_zero_and_said_so():
    found = fit(sections(-30.0 + 345.38 * SPEEDS**0.4418))
    assert found.held_at_zero
    assert found.friction.coulomb == 0.0
    assert found.standard_errors[0] == 0.0


@pytest.mark.parametrize(
    ("torque", "speeds", "error", "match"),
    [
        ([], [], 0.01, "too few steady speeds, found 0; expected at least 4"),
        (law()[:3], SPEEDS[:3], 0.01, "too few steady speeds, found 3"),
        (law(np.full(8, 2.0)), np.full(8, 2.0), 0.01, "too few steady speeds, found 1"),
        (law(SPEEDS / 5 + 5), SPEEDS / 5 + 5, 0.01, "too close to each other, found 5.06 .. 6.50"),
        (800.0 - 20.0 * SPEEDS, SPEEDS, 0.01, "does not rise with the speed"),
        (35.0 + 1.0 * SPEEDS**3, SPEEDS, 0.01, "it runs to 2.00, the end of its range"),
        (law(), SPEEDS, 60.0, "not determined: 0.44 with a standard error of"),
    ],
)
def test_stretches_that_do_not_determine_the_law_are_refused_by_name(torque, speeds, error, match):
    with pytest.raises(LossesError, match=match):
        fit(sections(torque, np.asarray(speeds), error))
