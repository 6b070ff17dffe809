"""Which tested laws become drafts."""

import pytest

from plant_emulator.diagnosis.missing_law.hypothesis_test import LawResult


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
