"""Least squares, priors, states, and standard errors that know of autocorrelation."""

from collections.abc import Mapping

import numpy as np
import pytest

from plant_emulator.estimation.covariance import (
    autocovariance,
    correlation_time,
    data_errors,
    sandwich,
    structure,
)
from plant_emulator.estimation.least_squares import estimate, linearise_at
from plant_emulator.estimation.leverage import bounding_weights
from plant_emulator.estimation.secant_slopes import SecantSlopes
from plant_emulator.estimation.simulated_problem import SimulatedProblem
from plant_emulator.estimation.unknowns import Unknown
from plant_emulator.signals.log import Array


def number(name: str, start: float, **more: object) -> Unknown:
    """An unknown on a linear scale, practically unbounded."""
    bounds = {"lower": -1e6, "upper": 1e6}
    return Unknown(name=name, start=start, logarithmic=False, **(bounds | more))  # type: ignore[arg-type]


# Misra1a of the NIST Statistical Reference Datasets (nonlinear regression, lower difficulty):
# y = b1 (1 - exp(-b2 x)); certified values and standard deviations to ten digits.
MISRA_X = np.array(
    [77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760]
)
MISRA_Y = np.array(
    [
        10.07,
        14.73,
        17.94,
        23.93,
        29.61,
        35.18,
        40.02,
        44.82,
        50.76,
        55.05,
        61.01,
        66.4,
        75.47,
        81.78,
    ]
)


def misra(v: Mapping[str, float]) -> Array:
    """Residual of the regression."""
    return (MISRA_Y - v["b1"] * (1 - np.exp(-v["b2"] * MISRA_X)))[None, :]


MISRA = [
    Unknown(name="b1", start=250.0, lower=1.0, upper=1e4),
    Unknown(name="b2", start=5e-4, lower=1e-6, upper=1e-1),
]


def test_nothing_is_simulated_twice() -> None:
    """The slopes where a fit has ended are those of its last step."""
    asked: list[tuple[float, ...]] = []

    def residual(v: Mapping[str, float]) -> Array:
        asked.append(tuple(v.values()))
        return misra(v)

    found = estimate(MISRA, [residual])
    assert found.converged
    assert len(set(asked)) == len(asked) == found.simulations


def test_known_lengths_of_slopes_spare_the_first_differences() -> None:
    """One for the point, two to learn the steps, two for the slopes, and two for wide ones."""
    first = linearise_at(MISRA, [misra])
    again = linearise_at(MISRA, [misra], lengths=first.lengths)
    assert (first.simulations, again.simulations) == (7, 5)
    np.testing.assert_allclose(first.jacobians[0], again.jacobians[0], rtol=1e-6)
    one = {("b1", None): first.lengths["b1", None]}
    assert linearise_at(MISRA, [misra], lengths=one).simulations == 6


def test_column_of_unknown_length_beside_known_ones_is_not_that_of_the_jitter() -> None:
    """Over the first difference the limit s does nothing yet, and its slope would stay zero."""
    x = np.linspace(-1.0, 1.0, 50)

    def residual(v: Mapping[str, float]) -> Array:
        acts = max(0.0, v["s"] - 0.005)
        return np.stack(
            [100.0 * (2.0 + 3.0 * x + 0.495 * x**2 - v["a"] - v["b"] * x - acts * x**2)]
        )

    unknowns = (number("a", 1.0), number("b", 1.0), number("s", 0.0))
    known = {("a", None): 707.0, ("b", None): 416.0}
    found = estimate(unknowns, [residual], lengths=known, difference=10.0, rough=True)
    assert found.parameters()["s"] == pytest.approx(0.5, abs=1e-3)
    assert found.cost < 1e-3


def test_columns_that_follow_are_not_simulated_and_lead_to_the_same_optimum() -> None:
    """Misra1a with a third unknown, from the estimate without it."""
    tilt = number("tilt", 0.0, scale=1e-3)
    near = estimate(MISRA, [misra])

    def tilted(v: Mapping[str, float]) -> Array:
        return misra({"b1": v["b1"], "b2": v["b2"]}) + 0.002 * MISRA_X - v["tilt"] * MISRA_X

    start = [
        Unknown(name=u.name, start=u.value(z), lower=u.lower, upper=u.upper)
        for u, z in zip(near.unknowns, near.z, strict=True)
    ]
    full = estimate([*start, tilt], [tilted])
    quick = estimate([*start, tilt], [tilted], follow=near)
    assert quick.cost == pytest.approx(full.cost, rel=0.05)
    assert quick.cost < 0.2 * near.cost
    for name, value in full.parameters().items():
        assert quick.parameters()[name] == pytest.approx(value, rel=0.05)
    first = estimate([*start, tilt], [tilted], follow=near, iterations=1)
    assert np.array_equal(first.jacobians[0][..., :2], near.jacobians[0])
    assert first.simulations == 2  # where it starts, and the tilt


def test_rough_fit_differences_anew_only_after_a_step_that_it_did_not_predict() -> None:
    """Three points are simulated, and all slopes at the first two: to learn the steps, then over
    them. A line keeps them at the third. By hand, Newton's steps for a^4 = 16 lead from 3 to 2.40
    and 2.09 and miss 36 and 22 % of the change: the slope is differenced at the third too.
    """
    line = [number("a", 5.0), number("b", -7.0)]
    x = np.linspace(-1.0, 1.0, 100)
    y = 2.0 + 3.0 * x + np.cos(40.0 * x)
    rough = estimate(line, [lambda v: (y - v["a"] - v["b"] * x)[None]], rough=True, iterations=3)
    assert rough.simulations == 3 + 2 * 2
    assert rough.parameters() == pytest.approx({"a": 2.0, "b": 3.0}, abs=0.05)
    power = [lambda v: np.full((1, 25), v["a"] ** 4 - 16.0)]
    bent = estimate([number("a", 3.0)], power, rough=True, iterations=3)
    assert bent.simulations == 3 + 3
    found = estimate(MISRA, [lambda v: 100.0 * misra(v)], rough=True)
    assert found.cost == pytest.approx(1e4 * 1.2455138894e-01, rel=1e-3)


def test_slopes_of_a_run_do_not_follow_the_states_of_another() -> None:
    """Each run knows its own state alone; the curve lets all slopes follow by secants."""
    unknowns = [number("a", 1.0), *(number("s", 0.5, run=k) for k in (0, 1))]
    x = np.linspace(0.0, 1.0, 50)
    data = [np.exp(0.8 * x) + 1.0, np.exp(0.8 * x) - 2.0]
    residuals = [lambda v, y=y: (y - np.exp(v["a"] * x) - v["s"])[None] for y in data]
    found = estimate(unknowns, residuals, rough=True)
    assert found.parameters()["a"] == pytest.approx(0.8, abs=0.02)
    assert np.all(found.jacobians[0][..., 2] == 0.0)
    assert np.all(found.jacobians[1][..., 1] == 0.0)
    assert np.any(found.jacobians[0][..., 1] != 0.0)


def test_covariance_of_a_rough_fit_is_that_of_white_residuals_of_variance_1() -> None:
    """By hand: the mean of 25 samples of variance 1, whatever the residuals are."""
    y = 10.0 * np.random.default_rng(1).standard_normal(25)
    found = estimate([number("a", 0.0)], [lambda v: (y - v["a"])[None]], rough=True)
    assert found.standard_errors == pytest.approx([0.2])


def test_turned_rows_and_slopes_keep_all_products() -> None:
    """The products are those of the residuals, the slopes by hand, and the priors."""
    x = np.linspace(-1.0, 1.0, 9)
    unknowns = (number("a", 2.0), number("b", 1.0, prior=0.5, std=0.25))

    def residual(v: Mapping[str, float]) -> Array:
        return np.stack([v["a"] * x, v["b"] * x**2 - 1.0])

    problem = SimulatedProblem(
        unknowns, [residual], None, SecantSlopes(unknowns), np.full(2, np.nan)
    )
    z = np.array([2.0, 1.0])
    rows, slopes = problem.turned_rows(z), problem.turned_slopes(z)
    zero = np.zeros(9)
    by_hand = np.block([[x[:, None], zero[:, None]], [zero[:, None], (x**2)[:, None]]])
    assert rows @ rows == pytest.approx(float(np.sum(residual({"a": 2.0, "b": 1.0}) ** 2)) + 4.0)
    assert slopes.T @ slopes == pytest.approx(by_hand.T @ by_hand + np.diag([0.0, 16.0]), abs=1e-4)
    gradient = by_hand.T @ residual({"a": 2.0, "b": 1.0}).ravel() + [0.0, 2.0 * 4.0]
    assert slopes.T @ rows == pytest.approx(gradient, abs=1e-4)


def test_weak_unknown_leaves_its_start() -> None:
    """By hand: 3 - a^2 changes by 2e-9 over a step of 1e-8 at 0.1, which last digits hide."""
    found = estimate([number("a", 0.1)], [lambda v: np.full((1, 25), 3.0 - v["a"] ** 2)])
    assert found.parameters()["a"] == pytest.approx(3.0**0.5, rel=1e-6)
    prior = [number("b", 0.0, prior=0.0, std=100.0)]
    shrunk = estimate(prior, [lambda v: np.full((1, 20), 1.0 - 0.1 * v["b"])])
    assert shrunk.parameters()["b"] == pytest.approx(9.995, abs=0.01)


def test_sample_on_a_contact_does_not_hold_the_fit() -> None:
    """A line of slope 2 through 200 samples; one passes a contact within 1e-7 of the start.

    Newton's step with all samples alike goes 5e-8, to where that one is zero. Anywhere else it is
    off by 5.
    """
    x = np.linspace(-1.0, 1.0, 200)

    def residual(v: Mapping[str, float]) -> Array:
        misses = (2.0 - v["a"]) * x
        misses[100] = 5.0 * np.tanh((v["a"] - 5.0) * 1e7 + 0.5)
        return misses[None]

    found = estimate([number("a", 5.0)], [residual])
    assert found.parameters()["a"] == pytest.approx(2.0, abs=1e-6)
    assert found.cost == pytest.approx(25.0)


def test_bounded_leverage_does_not_move_the_optimum() -> None:
    """One of 200 samples tells the slope of a line alone: the fit is plain least squares."""
    x = np.append(np.linspace(-1.0, 1.0, 199), 400.0)
    y = np.cos(40.0 * x)
    line = [number("a", 5.0), number("b", -7.0)]
    found = estimate(line, [lambda v: (y - v["a"] - v["b"] * x)[None]])
    slope, level = np.polyfit(x, y, 1)
    assert found.parameters() == pytest.approx({"a": level, "b": slope}, rel=1e-5)


def test_weights_bound_the_leverage_and_spare_the_rest() -> None:
    """By hand: beside 100 samples of slope 1 a weight w gives a slope of 1000 the leverage
    (1000 w)^2 / (100 + (1000 w)^2), 0.3 at w^2 = 100 * 3 / 7 / 1e6.
    """
    slopes = [np.ones((100, 1)), np.array([[1000.0]])]
    many, one = bounding_weights(slopes, np.zeros((1, 1)))
    assert np.all(many == 1.0)
    assert one[0] ** 2 == pytest.approx(300.0 / 7.0 / 1e6, rel=1e-6)
    _, beside_prior = bounding_weights(slopes, np.array([[1e6]]))
    assert beside_prior[0] == 1.0
    _, unseen = bounding_weights([np.zeros((3, 1)), np.zeros((1, 1))], np.zeros((1, 1)))
    assert unseen[0] == 1.0


@pytest.mark.parametrize("start", [(500.0, 1e-4), (250.0, 5e-4)])  # NIST's two starts
def test_certified_regression_is_reproduced(start: tuple[float, float]) -> None:
    unknowns = [
        Unknown(name="b1", start=start[0], lower=1.0, upper=1e4),
        Unknown(name="b2", start=start[1], lower=1e-6, upper=1e-1),
    ]
    found = estimate(unknowns, [misra])
    assert found.converged
    assert found.parameters()["b1"] == pytest.approx(2.3894212918e02, rel=1e-5)
    assert found.parameters()["b2"] == pytest.approx(5.5015643181e-04, rel=1e-5)
    assert found.cost == pytest.approx(1.2455138894e-01, rel=1e-6)


def test_standard_errors_are_those_of_the_normal_equations_for_white_residuals() -> None:
    random = np.random.default_rng(3)
    x = np.linspace(-1.0, 1.0, 4000)
    y = 2.0 + 0.5 * x + 0.3 * random.standard_normal(len(x))

    def residual(v: Mapping[str, float]) -> Array:
        return (y - v["a"] - v["b"] * x)[None, :]

    found = estimate([number("a", 0.0), number("b", 0.0)], [residual])
    # by hand: 0.3 / sqrt(n), and 0.3 / sqrt(sum x^2) = 0.3 / sqrt(n / 3)
    by_hand = [0.3 / np.sqrt(4000), 0.3 / np.sqrt(4000 / 3)]
    assert found.standard_errors == pytest.approx(by_hand, rel=0.05)
    assert found.correlation[0, 1] == pytest.approx(0.0, abs=0.05)


def coloured_noise(n: int, phi: float, random: np.random.Generator) -> Array:
    """AR(1) noise of variance 1."""
    noise = np.empty(n)
    noise[0] = random.standard_normal()
    for k in range(1, n):
        noise[k] = phi * noise[k - 1] + np.sqrt(1 - phi**2) * random.standard_normal()
    return noise


def test_correlation_time_of_coloured_noise_is_that_of_its_law() -> None:
    noise = coloured_noise(40_000, 0.8, np.random.default_rng(1))
    assert correlation_time(noise) == pytest.approx((1 + 0.8) / (1 - 0.8), rel=0.15)
    assert correlation_time(np.random.default_rng(1).standard_normal(40_000)) == pytest.approx(
        1.0, abs=0.1
    )


def test_samples_that_do_not_count_change_no_autocovariance() -> None:
    noise = coloured_noise(20_000, 0.5, np.random.default_rng(2))
    holed = noise.copy()
    holed[::7] = 0.0
    assert autocovariance(holed)[:2] == pytest.approx([1.0, 0.5], rel=0.1)


@pytest.mark.slow
def test_intervals_under_coloured_residuals_cover_the_truth() -> None:
    """White-noise errors would be three times too small and cover half of the cases."""
    x = np.linspace(-1.0, 1.0, 1500)
    hits = []
    for seed in range(200):
        y = 1.0 + 2.0 * x + coloured_noise(len(x), 0.8, np.random.default_rng(seed))

        def residual(v: Mapping[str, float], y: Array = y) -> Array:
            return (y - v["a"] - v["b"] * x)[None, :]

        found = estimate([number("a", 0.0), number("b", 0.0)], [residual])
        error = np.abs(found.z - [1.0, 2.0])
        hits.append(error < 1.96 * found.standard_errors)
    assert 0.90 <= np.mean(hits) <= 0.99


def test_prior_alone_gives_back_itself() -> None:
    found = estimate([number("silent", 1.0, prior=3.0, std=0.2)], [lambda v: np.ones((1, 50))])
    assert found.parameters()["silent"] == pytest.approx(3.0)
    assert found.standard_errors[0] == pytest.approx(0.2)
    assert found.data_errors[0] == np.inf


def test_fit_does_not_begin_where_nothing_changes_the_residual() -> None:
    """As where no run can be simulated: every sample is the same large number."""
    free = number("a", 2.0)
    found = estimate([free], [lambda _: np.full((1, 50), 100.0)])
    assert not found.converged
    assert found.parameters() == {"a": pytest.approx(2.0)}


def test_prior_and_data_are_weighed_by_their_precision() -> None:
    # 100 samples of 1.0 with unit noise: standard error 0.1; prior 0.0 +- 0.1: the middle
    found = estimate(
        [number("a", 0.3, prior=0.0, std=0.1)], [lambda v: np.full((1, 100), 1.0 - v["a"])]
    )
    assert found.parameters()["a"] == pytest.approx(0.5, rel=1e-6)


def test_state_belongs_to_its_run_only() -> None:
    def run(level: float) -> object:
        return lambda v: np.full((1, 20), level - v["slope"] * 0.0 - v["offset"])

    unknowns = [
        number("slope", 1.0, prior=1.0, std=1.0),
        number("offset", 0.0, run=0),
        number("offset", 0.0, run=1),
    ]
    found = estimate(unknowns, [run(4.0), run(-2.0)])  # type: ignore[list-item]
    assert found.states(0)["offset"] == pytest.approx(4.0)
    assert found.states(1)["offset"] == pytest.approx(-2.0)
    # a state costs a simulation of its own run only: 2 runs, then 2 + 1 + 1 a Jacobian
    assert np.all(found.jacobians[0][..., 2] == 0.0)


def test_direction_that_the_data_do_not_see_has_no_finite_error() -> None:
    columns = np.array([[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]])  # only the sum shows
    assert np.all(data_errors(columns.T @ columns) > 1e6)
    assert data_errors(np.diag([4.0, 0.0])) == pytest.approx([0.5, np.inf])


def test_bound_holds() -> None:
    unknowns = [number("a", 0.5, lower=0.0, upper=1.0)]
    found = estimate(unknowns, [lambda v: np.full((1, 10), 3.0 - v["a"])])
    assert found.parameters()["a"] == pytest.approx(1.0, abs=1e-5)


def test_information_is_that_of_the_starts_where_nothing_is_fitted() -> None:
    """The residual's norm changes by 5 a unit: the slope is taken over the widest step, 0.01."""
    found = linearise_at([number("a", 2.0)], [lambda v: np.full((1, 25), v["a"] ** 2 / 4.0)])
    assert found.information[0, 0] == pytest.approx(25 * ((2.01**2 - 2.0**2) / 0.04) ** 2)


def test_what_neither_data_nor_prior_know_has_no_finite_error() -> None:
    found = linearise_at(
        [number("seen", 1.0), number("unseen", 1.0)], [lambda v: np.full((1, 9), v["seen"])]
    )
    assert found.standard_errors[1] == np.inf
    assert found.data_errors[1] == np.inf
    assert found.correlation[0, 1] == 0.0


def test_structure_is_none_in_white_noise_and_that_of_a_hidden_ripple() -> None:
    """White: 0 +- sqrt(2 lags). A ripple of variance v beside noise of 1: correlations
    v / (1 + v) cos, whose squares over 20 lags of whole periods sum to 10 (v / (1 + v))^2."""
    random = np.random.default_rng(2)
    white = [structure(random.standard_normal(3000)) for _ in range(200)]
    assert np.mean(white) == pytest.approx(0.0, abs=3.0 * np.sqrt(40.0 / 200.0))
    assert np.std(white) == pytest.approx(np.sqrt(40.0), rel=0.2)
    n = np.arange(3000)
    rippled = random.standard_normal(3000) + np.sin(2.0 * np.pi * n / 5.0)
    assert structure(rippled) == pytest.approx(3000 * 10.0 * (0.5 / 1.5) ** 2, rel=0.1)


def test_what_two_unknowns_share_alone_is_known_of_neither() -> None:
    """By hand: slopes 1 and -1 over 100 samples in turn, white residuals of variance 1: the third
    unknown's variance is 1/100; of two with the same slope only the sum is known, which rounding
    must not hide (an eigenvalue of -2e-15 had made their variance negative).
    """
    slope = np.random.default_rng(3).standard_normal(100)
    third = np.tile([1.0, -1.0], 50)
    slope -= third * (slope @ third) / 100.0
    jacobian = np.stack([slope, (1.0 + 1e-12) * slope, third], axis=1)[None]
    residual = np.random.default_rng(0).standard_normal((1, 100))
    residual /= np.sqrt(np.mean(residual**2))
    information = jacobian[0].T @ jacobian[0]
    found = sandwich([residual], [jacobian], information, np.zeros((3, 3)))
    assert np.isinf(found[[0, 1], [0, 1]]).all()
    assert found[2, 2] == pytest.approx(1.0 / 97.0, rel=1e-9)  # less three that were fitted


def test_a_variance_that_a_tapered_autocovariance_makes_negative_is_that_of_white_residuals() -> (
    None
):
    """The spectrum of a step in the residual, tapered, falls below 0 between the frequencies of its
    Fourier transform; an unknown that acts at such a frequency only has J'J = 600 / 2 by hand.
    """
    n = np.arange(600)
    residual = np.where(n < 300, 5.0, -5.0) + np.random.default_rng(1).standard_normal(600)
    variances = []
    for frequency in np.linspace(0.01, 0.05, 401):
        slope = np.sin(2.0 * np.pi * frequency * n)[None, :, None]
        information = np.array([[float((slope**2).sum())]])
        found = sandwich([residual[None]], [slope], information, np.zeros((1, 1)))
        variances.append(found[0, 0])
    assert min(variances) > 0.0
    assert min(abs(v * 300.0 - 1.0) for v in variances) < 0.05  # some of them are of the white kind
