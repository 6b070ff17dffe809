"""The reduced regression: equal to the whole one, and judged by other runs."""

import numpy as np
import pytest

from plant_emulator.diagnosis.missing_law.reduced import RunRows, products


def runs(size: float, seed: int = 1) -> tuple[list[RunRows], list[np.ndarray]]:
    """Three runs with shared and own nuisance columns, a true column of this size, a wrong one."""
    random = np.random.default_rng(seed)
    rows, columns = [], []
    for _ in range(3):
        shared, own = random.standard_normal((400, 2)), random.standard_normal((400, 1))
        two = 0.1 * random.standard_normal((400, 2))
        y = shared @ [0.4, -0.8] + own[:, 0] * 0.7 + two[:, 0] * size
        rows.append(RunRows(y + random.standard_normal(400), shared, own))
        columns.append(two)
    return rows, columns


def test_coefficients_are_those_of_the_whole_least_squares_problem() -> None:
    rows, columns = runs(20.0)
    found = products(rows, columns)
    estimated = found.coefficients([0, 1], range(3))
    # the whole problem: shared columns, own columns of every run with unit priors, both terms
    blocks = [
        np.concatenate([one.shared, np.kron(np.eye(3)[[k]], one.own), part], axis=1)
        for k, (one, part) in enumerate(zip(rows, columns, strict=True))
    ]
    x, y = np.concatenate(blocks), np.concatenate([one.y for one in rows])
    prior = np.diag([1.0] * 5 + [0.0, 0.0])
    whole = np.linalg.solve(x.T @ x + prior, x.T @ y)
    np.testing.assert_allclose(estimated[:2], whole[:2], rtol=1e-5)
    np.testing.assert_allclose(estimated[2:] / found.scale, whole[5:], rtol=1e-5)


def test_true_column_saves_held_out_loss_and_a_column_of_chance_does_not() -> None:
    found = products(*runs(20.0))
    before, true, wrong = (found.held_out_losses(c).sum() for c in ([], [0], [1]))
    # 1200 rows of (0.1 * 20)^2 = 4 each, half of it
    assert before - true == pytest.approx(2400.0, rel=0.1)
    assert before - wrong < 10.0


def test_column_of_each_run_s_own_may_differ_from_run_to_run() -> None:
    rows, columns = runs(0.0)
    for k, (one, part) in enumerate(zip(rows, columns, strict=True)):
        rows[k] = RunRows(one.y + 20.0 * (-1.0) ** k * part[:, 0], one.shared, one.own)
    together, apart = products(rows, columns), products(rows, columns, [True, False])
    assert together.held_out_losses([0]).sum() > together.held_out_losses([]).sum()
    assert apart.held_out_losses([0]).sum() < apart.held_out_losses([]).sum() - 2000.0
    sizes = [
        apart.own_coefficients([0], apart.coefficients([0], range(3)), k)[0] / apart.scale[0]
        for k in range(3)
    ]
    np.testing.assert_allclose(sizes, [20.0, -20.0, 20.0], atol=2.0)
