"""Gain of log evidence against the Gaussian integral done directly."""

from __future__ import annotations

import numpy as np
import pytest

from plant_emulator.estimation.regression import Regression, gain


def log_density(y: np.ndarray, covariance: np.ndarray) -> float:
    """Log of the normal density of y but for the constant."""
    return float(-0.5 * y @ np.linalg.solve(covariance, y) - 0.5 * np.linalg.slogdet(covariance)[1])


@pytest.fixture
def problem() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(1)
    nuisance, columns = random.standard_normal((60, 4)), random.standard_normal((60, 2))
    y = nuisance @ random.standard_normal(4) + columns @ [0.7, -0.4] + random.standard_normal(60)
    return y, nuisance, columns


def test_gain_is_the_ratio_of_the_probabilities(
    problem: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    y, nuisance, columns = problem
    data = Regression.of(y, nuisance)
    products = data.products(columns)
    found, _ = gain(products.gram, products.along)
    without = np.eye(60) + nuisance @ nuisance.T
    with_them = without + columns @ columns.T
    assert found == pytest.approx(log_density(y, with_them) - log_density(y, without))


def test_coefficients_are_the_joint_posterior_mean(
    problem: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    y, nuisance, columns = problem
    data = Regression.of(y, nuisance)
    products = data.products(columns)
    _, beta = gain(products.gram, products.along)
    both = np.concatenate([nuisance, columns], axis=1)
    joint = np.linalg.solve(np.eye(6) + both.T @ both, both.T @ y)
    assert beta == pytest.approx(joint[4:])
    assert data.theta(products, beta) == pytest.approx(joint[:4])


def test_steep_columns_do_not_round_the_prior_away() -> None:
    """By hand: of two equal columns each takes half. Their squares have no room for the prior."""
    column = np.random.default_rng(2).standard_normal(60)
    nuisance = 1e9 * np.stack([column, column], axis=1)
    data = Regression.of(1e9 * column, nuisance)
    assert data.mean == pytest.approx([0.5, 0.5])


def test_steep_column_that_the_nuisance_follows_gains_nothing() -> None:
    """By hand: k f beside f of the squares s is followed but for the prior: k^2 s / (1 + s)."""
    random = np.random.default_rng(2)
    nuisance = 1e8 * random.standard_normal((60, 1))
    data = Regression.of(random.standard_normal(60), nuisance)
    products = data.products(1e6 * nuisance)
    assert products.gram[0, 0] == pytest.approx(1e12, rel=1e-6)
    value, _ = gain(products.gram, products.along)
    assert value == pytest.approx(-np.log(1e6), abs=1.0)
