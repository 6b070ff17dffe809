"""The confidence of an answer, from cases of known truth."""

from collections.abc import Sequence

import numpy as np
import pytest

from plant_emulator.diagnosis.calibration.confidence import Standing, TrialVerdict, confidence


def answer(log_odds: float, kind: str = "effect") -> Standing:
    return Standing(kind=kind, log_odds=log_odds)


def cases(kind: str, odds: Sequence[float], rights: Sequence[bool]) -> list[TrialVerdict]:
    return [
        TrialVerdict(kind=kind, log_odds=float(one), right=bool(right))
        for one, right in zip(odds, rights, strict=True)
    ]


def test_the_share_of_right_answers_is_the_confidence_where_all_stand_alike() -> None:
    """400 cases, 300 right: three quarters, but for priors that 400 cases outweigh."""
    known = cases("effect", np.zeros(400), np.arange(400) < 300)
    assert confidence(known, answer(0.0)) == pytest.approx(0.75, abs=0.005)


def test_answers_whose_rival_is_one_needless_effect_more_have_the_larger_confidence() -> None:
    """Drawn by the law log(p / (1 - p)) = 3 - log(1 + |40 - odds|), which is found again."""
    random = np.random.default_rng(4)
    odds = random.uniform(0.0, 80.0, 4000)
    share = 1.0 / (1.0 + np.exp(np.log1p(np.abs(40.0 - odds)) - 3.0))
    known = cases("effect", odds, (random.random(4000) < share).tolist())
    for one in (0.0, 35.0, 40.0, 60.0):
        true = 1.0 / (1.0 + np.exp(np.log1p(abs(40.0 - one)) - 3.0))
        assert confidence(known, answer(one)) == pytest.approx(true, abs=0.05)


def test_few_cases_give_no_certainty() -> None:
    found = confidence(cases("unknown", [0.0, 0.0], [True, True]), answer(0.0, kind="unknown"))
    assert found is not None
    assert 0.5 < found < 0.95


def test_other_parameters_and_nothing_are_counted_together() -> None:
    known = cases("none", np.full(50, 10.0), [True] * 50)
    assert confidence(known, answer(10.0, kind="parameter")) == confidence(
        known, answer(10.0, kind="none")
    )


def test_a_verdict_that_no_trial_had_has_no_confidence() -> None:
    assert confidence(cases("none", [1.0], [True]), answer(1.0)) is None
