"""The scan finds a ripple at any multiple of an angle; no line of noise is worth its price."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.missing_law.law_search import LawSearch, search
from plant_emulator.diagnosis.missing_law.line_scan import SLOWEST, find_lines, with_lines
from plant_emulator.diagnosis.missing_law.quantity import LawQuantity
from plant_emulator.diagnosis.missing_law.reduced import LawRows, RunRows
from plant_emulator.diagnosis.missing_law.states import LawState
from plant_emulator.signals.log import Array

# Two runs of unlike speed, and the phase of the ripple in each.
TIME = np.arange(4000) * 0.01
ANGLES = [4.0 * TIME + 0.3 * np.sin(TIME), 3.0 * TIME + TIME**2 / 40.0]
PHASES = (0.4, -2.0)
# Largest multiple of the scan. The longer run turns by 160 rad: its lines are pi / 160 apart.
LARGEST = 9.0
SPAN = 160.0


def angle(scanned: float = LARGEST) -> LawState:
    return LawState(
        name="angle of the drum",
        symbol="theta",
        unit="rad",
        code="s.drum_speed",
        kind="angle",
        values=ANGLES,
        time=[TIME] * 2,
        scanned=scanned,
    )


def runs_with(*ripples: tuple[float, float], seed: int = 1) -> LawRows:
    """Rows that show the law as it is, in noise of 1; ripples : size and multiple of each."""
    rng = np.random.default_rng(seed)

    def run(turned: Array, phase: float) -> RunRows:
        y = sum((a * np.cos(k * turned + phase) for a, k in ripples), rng.normal(size=len(TIME)))
        return RunRows(np.asarray(y), np.ones((len(TIME), 1)), np.zeros((len(TIME), 0)))

    return LawRows(
        [run(*one) for one in zip(ANGLES, PHASES, strict=True)], lambda _, values: values
    )


@pytest.mark.parametrize("multiple", [0.734, 3.9266, 8.41])
def test_a_line_lies_where_the_ripple_is(multiple: float) -> None:
    first, _ = find_lines(runs_with((0.3, multiple)), angle()).multiples
    # Deviation of a line's place in white noise (Rife and Boorstyn 1974): sqrt(24 / n) / (A SPAN).
    assert first == pytest.approx(multiple, abs=4.0 * np.sqrt(24.0 / len(TIME)) / (0.3 * SPAN))


def test_the_smaller_line_is_found_beside_the_larger_one() -> None:
    found = find_lines(runs_with((3.0, 2.2), (0.3, 2.31)), angle()).multiples
    assert found == pytest.approx((2.2, 2.31), abs=0.005)


def searched(rows: LawRows) -> LawSearch:
    quantity = LawQuantity(
        place="drum", name="torque", unit="N m", hook="drum_torque", states=(angle(),)
    )
    return search(rows, with_lines(rows, quantity), rows.null_loss())


def gains(rows: LawRows) -> Sequence[float]:
    """Held-out gain of the ripple at each line of the scan."""
    found = searched(rows)
    return [found.gain([j]) for j, term in enumerate(found.terms) if len(term.states) == 1]


def test_no_line_of_noise_gains_on_other_runs() -> None:
    assert all(max(gains(runs_with(seed=seed))) < 0.0 for seed in range(2, 12))


def test_a_ripple_pays() -> None:
    # Its squares are 0.3^2 / 2 a sample, 360 in both runs; the phases cost 32 of it.
    assert 260.0 < gains(runs_with((0.3, 3.9266)))[0] < 460.0


def test_each_run_has_the_phase_of_its_own() -> None:
    law = searched(runs_with((3.0, 3.9266))).law([1])
    assert law.coefficients == pytest.approx((3.0,), abs=0.1)
    assert [own["phase11"] for own in law.phases] == pytest.approx(PHASES, abs=0.05)


def test_a_law_leaves_the_noise_of_the_runs() -> None:
    rows = runs_with((3.0, 3.9266))
    left = searched(rows).left([1])
    assert [float(np.mean(own**2)) for own in left] == pytest.approx([1.0, 1.0], abs=0.1)
    assert float(np.mean(rows.runs[0].y ** 2)) > 5.0


@pytest.mark.parametrize("scanned", [0.0, 0.1])
def test_an_angle_that_hardly_turns_is_not_scanned(scanned: float) -> None:
    assert find_lines(runs_with((3.0, 2.2)), angle(scanned)).multiples == ()


@pytest.mark.parametrize("seed", range(20))
def test_no_line_is_slower_than_a_trend_or_faster_than_the_scan(seed: int) -> None:
    short = replace(angle(4.5), values=[one / 25.0 for one in ANGLES])
    lines = find_lines(runs_with(seed=seed), short).multiples
    assert lines
    assert all(SLOWEST <= one <= 4.5 for one in lines)
