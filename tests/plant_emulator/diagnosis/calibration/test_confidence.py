"""The confidence of an answer, from cases of known truth; shares by hand."""

import pytest

from plant_emulator.diagnosis.calibration.confidence import FEWEST_CASES, TrialVerdict, confidence


def cases(kind: str, *rights: bool) -> list[TrialVerdict]:
    """Cases of rising evidence 100, 200, ..."""
    return [
        TrialVerdict(kind=kind, evidence=100.0 * (k + 1), right=right)
        for k, right in enumerate(rights)
    ]


def test_only_cases_of_at_least_the_evidence_count() -> None:
    """30 cases, the 5 weakest wrong: from 501 on all 25 are right."""
    known = cases("effect", *[False] * 5, *[True] * 25)
    assert confidence(known, "effect", 501.0) == pytest.approx(26 / 27)
    assert confidence(known, "effect", 1.0) == pytest.approx(26 / 32)


def test_evidence_beyond_most_cases_is_not_punished_for_their_number() -> None:
    known = cases("effect", *[True] * 30)
    assert confidence(known, "effect", 1e9) == pytest.approx(
        (FEWEST_CASES + 1) / (FEWEST_CASES + 2)
    )


def test_evidence_of_a_verdict_without_a_name_says_nothing() -> None:
    known = cases("unknown", True, True, False)
    assert confidence(known, "unknown", 1e9) == confidence(known, "unknown", 0.0) == 3 / 5


def test_kind_without_cases_has_no_confidence() -> None:
    assert confidence(cases("none", True), "effect", 100.0) is None
