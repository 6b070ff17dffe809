"""Which tested laws become drafts."""

import numpy as np
import pytest

from plant_emulator.diagnosis.fit_result import FitResult
from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.missing_law.hypothesis_test import (
    DraftedLaw,
    LawResult,
    laws_to_follow,
    try_law,
)
from tests.plant_emulator.diagnosis.line import TIME, Line, effect, noisy


def fitted(mean_square: float) -> FitResult:
    return FitResult(
        effects=(),
        values={},
        states=(),
        cost=100.0 * mean_square,
        sum_of_squares=100.0 * mean_square,
        samples=100,
        effective_fraction=1.0,
        standard_errors={},
        converged=True,
    )


@pytest.mark.parametrize(
    ("null", "trials", "expected"),
    [
        (11.0, [1.0, 5.9, 6.1], [True, True, False]),  # of the 10 that the best one explains, half
        (11.0, [10.9, 12.0], [False, False]),  # 2 % of the gap are 0.2
        (11.0, [10.7], [True]),
    ],
)
def test_law_is_followed_if_it_explains_enough_of_the_runs_that_it_is_fitted_to(
    null: float, trials: list[float], expected: list[bool]
) -> None:
    assert laws_to_follow([fitted(one) for one in trials], fitted(null)) == expected


@pytest.mark.parametrize(
    ("gain", "interval", "terms", "expected"),
    [
        (0.8, (0.7, 0.9), 3, True),
        (0.004, (0.001, 0.007), 3, False),  # of correlated noise a law follows a little
        (0.03, (0.02, 0.04), 1, True),
        (0.03, (0.02, 0.04), 2, False),
        (0.5, (-0.1, 0.8), 1, False),
        (None, None, 1, False),
    ],
)
def test_draft_closes_a_certain_part_of_the_gap_worth_its_terms(
    gain: float | None, interval: tuple[float, float] | None, terms: int, expected: bool
) -> None:
    result = LawResult(
        effect="draft",
        fit=None,  # type: ignore[arg-type]  # no fit here
        gain=gain,
        interval=interval,
        traces=(),
    )
    assert result.is_draft(terms) is expected


@pytest.mark.parametrize(("told", "fitted"), [(1.0, True), (6.0, False), (30.0, False)])
def test_law_whose_start_leaves_far_more_than_no_law_starts_no_fit(
    told: float, *, fitted: bool
) -> None:
    """By hand, in parts of 2000 samples: a wave of 1 leaves 1 + 1 / 2 without a law.

    From a start of 6 it leaves 1 + 25 / 2, more than twice that, and from one of 1 the noise.
    """
    model = Line([noisy(2.0 + 3.0 * TIME + np.sin(20.0 * TIME))], ["wave"])
    model.candidates["wave"] = effect("wave", told)
    null = fit_null(model, [0])
    found = try_law(model, DraftedLaw(effect="wave", values=null.values, null=null, runs=(0,)))
    assert (found is not null) is fitted
