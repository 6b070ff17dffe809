"""The marginal likelihood of a linear model against the dense normal distribution of scipy."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from plant_emulator.diagnosis.localisation.marginal_likelihood import (
    LinearModel,
    log_marginal_likelihood,
    variance_gain,
)

RANDOM = np.random.default_rng(3)
NUISANCE, LAW = RANDOM.standard_normal((40, 2)), RANDOM.standard_normal((40, 3))
NOISE = RANDOM.standard_normal(40)


@pytest.mark.parametrize("size", [0.3, 5.0])
def test_it_is_the_marginal_density_up_to_the_noise_s_own_constant(size: float) -> None:
    y = NOISE + LAW @ [1.0, -2.0, 0.5]
    covariance = np.eye(40) + NUISANCE @ NUISANCE.T + size**2 * LAW @ LAW.T
    expected = multivariate_normal(np.zeros(40), covariance).logpdf(y)
    columns = np.concatenate([NUISANCE, LAW], axis=1)
    deviations = np.array([1.0, 1.0, size, size, size])
    found = log_marginal_likelihood(columns.T @ columns, columns.T @ y, deviations)
    constant = -20.0 * np.log(2.0 * np.pi) - 0.5 * y @ y
    assert found + constant == pytest.approx(expected, abs=1e-9)


def test_noise_takes_no_group() -> None:
    data = LinearModel(NOISE, [NUISANCE])
    assert data.marginal_likelihood([LAW]).log - data.marginal_likelihood([]).log < 2.0


def test_of_two_groups_the_one_in_the_data_is_found_with_its_coefficients() -> None:
    other = RANDOM.standard_normal((40, 3))
    found = LinearModel(NOISE + LAW @ [6.0, -7.0, 8.0], [NUISANCE]).marginal_likelihood(
        [other, LAW]
    )
    assert found.mean[5:] == pytest.approx([6.0, -7.0, 8.0], abs=0.6)
    assert np.abs(found.mean[2:5]).max() < 0.6


def test_unrest_is_seen_where_its_weight_lies_and_nowhere_in_white_noise() -> None:
    white = np.random.default_rng(1).standard_normal(4000)
    weight = np.where(np.arange(4000) < 1000, 1.0, 0.0)
    restless = white * np.sqrt(1.0 + 9.0 * weight)
    # 1000 samples of variance 10: (10 (1 - 1/10) - log 10) / 2 each at the best size
    assert variance_gain(restless, weight) == pytest.approx(1000 * 3.35, rel=0.1)
    assert variance_gain(white, weight) < 1.0
