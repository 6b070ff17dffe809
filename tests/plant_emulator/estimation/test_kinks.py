"""A fit that stalled behind a ridge of its cost is led over it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from plant_emulator.estimation.kinks import beyond_kink
from plant_emulator.estimation.least_squares import estimate
from plant_emulator.estimation.unknowns import Unknown

if TYPE_CHECKING:
    from collections.abc import Mapping

# The residual is zero at 1. A ridge near 1.004 lies between 1 and the start.
TRUTH, RIDGE, START = 1.0, 1.004, 1.0055


def _unknown(start: float, run: int | None = None) -> Unknown:
    return Unknown(name="instant", start=start, lower=0.5, upper=2.0, run=run)


def _residual(values: Mapping[str, float]) -> np.ndarray:
    at = values["instant"]
    return np.array([[100.0 * (at - TRUTH), 2.0 * np.exp(-(((at - RIDGE) / 1e-3) ** 2))]])


def test_a_descent_stalls_behind_the_ridge_and_its_foot_is_found_from_there() -> None:
    stalled = estimate((_unknown(START),), [_residual])
    assert stalled.parameters()["instant"] > RIDGE

    beyond = beyond_kink(stalled.started, [_residual])

    assert beyond is not None
    led = estimate(beyond, [_residual])
    assert led.parameters()["instant"] == pytest.approx(TRUTH, abs=1e-6)


def test_a_state_is_changed_in_its_own_run_only() -> None:
    found = beyond_kink((_unknown(TRUTH, run=0), _unknown(1.006, run=1)), [_residual, _residual])

    assert found is not None
    assert found[0].start == TRUTH
    assert found[1].start == pytest.approx(TRUTH, abs=1e-3)


def test_no_kink_is_seen_at_a_minimum() -> None:
    assert beyond_kink((_unknown(TRUTH),), [_residual]) is None


def test_a_fall_of_a_few_percent_is_no_kink() -> None:
    def slope(values: Mapping[str, float]) -> np.ndarray:
        return np.array([[1.0 + values["instant"]]])

    assert beyond_kink((_unknown(START),), [slope]) is None


def test_bounds_hold() -> None:
    bounded = Unknown(name="instant", start=1.006, lower=1.0055, upper=2.0)
    assert beyond_kink((bounded,), [_residual]) is None
