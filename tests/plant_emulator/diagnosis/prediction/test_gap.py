"""The held-out gap, the closed fraction and its interval, by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from plant_emulator.diagnosis.machine import MeasuredRun
from plant_emulator.diagnosis.prediction.gap import (
    Prediction,
    block_lengths,
    closed_fraction,
    closed_fraction_interval,
    combined_gap,
    measure_gap,
    shows_shrinkage,
    tells_share,
)
from plant_emulator.diagnosis.prediction.held_out import NOMINAL
from plant_emulator.diagnosis.report.shrinkage import held_out_gap
from plant_emulator.signals.log import Array


def prediction(*channels: Array) -> Prediction:
    """One run."""
    return Prediction(residuals=(np.stack(channels),), converged=True)


def constant(*levels: float) -> Prediction:
    """A run of 100 samples with these whitened residuals."""
    return prediction(*(np.full(100, level) for level in levels))


def measured_run(*channels: str, samples: int = 100, noise: float = 1.0) -> MeasuredRun:
    """A run with these channels, each with the same noise."""
    return MeasuredRun(
        source="run",
        channels=channels,
        units=("1",) * len(channels),
        time=np.arange(float(samples)),
        measured=np.zeros((len(channels), samples)),
        noise=np.full(len(channels), noise),
        noise_ratio=np.ones((len(channels), 1)),
    )


NAMES = [measured_run("a", "b")]


def test_closed_fraction_by_hand() -> None:
    """3 and 2 times the noise before, 1.5 and 1 after: 1 - (1.25 + 0) / (8 + 3)."""
    before = measure_gap(NAMES, [constant(3.0, 2.0)], [10])
    after = measure_gap(NAMES, [constant(1.5, 1.0)], [10])
    assert before.by_channel == pytest.approx([3.0, 2.0])
    assert closed_fraction(before, after) == pytest.approx(1 - 1.25 / 11)


def test_predictions_that_go_astray_in_some_blocks_leave_the_share_open() -> None:
    """By hand: two draws of halves that leave 0 or 63 of a gap of 8 close 1, -2.9 or -6.9 of it."""
    run = [measured_run("a")]
    before = measure_gap(run, [constant(3.0)], [50])
    astray = measure_gap(run, [prediction(np.repeat([1.0, 8.0], 50))], [50])
    assert not tells_share(before, astray)
    assert not shows_shrinkage(before, astray)
    assert tells_share(before, measure_gap(run, [constant(1.5)], [50]))
    assert tells_share(before, before)


@pytest.mark.parametrize(
    ("levels", "told"), [((2.9, 3.1), False), ((2.4, 2.6), True), ((3.2, 3.3), True)]
)
def test_prediction_that_is_neither_better_nor_worse_leaves_a_faint_effect_open(
    levels: tuple[float, float], told: bool
) -> None:
    """By hand: of a gap of 8, draws of halves close (9 - 8.41) / 8 = 0.07, (9 - 9.61) / 8 or 0.

    Levels of 2.4 and 2.6 close 0.28 or more, those of 3.2 and 3.3 nothing.
    """
    run = [measured_run("a")]
    before = measure_gap(run, [constant(3.0)], [50])
    after = measure_gap(run, [prediction(np.repeat(levels, 50))], [50])
    assert tells_share(before, after, faint=True) is told
    assert tells_share(before, after)


def test_channel_at_the_noise_before_does_not_count() -> None:
    before = measure_gap(NAMES, [constant(3.0, 1.05)], [10])
    after = measure_gap(NAMES, [constant(1.0, 2.0)], [10])
    assert closed_fraction(before, after) == pytest.approx(1.0)


def test_no_gap_has_no_closed_fraction() -> None:
    before = measure_gap(NAMES, [constant(1.0, 1.09)], [10])
    assert closed_fraction(before, before) is None
    assert closed_fraction_interval(before, before) is None


def test_worse_prediction_closes_less_than_nothing() -> None:
    before = measure_gap(NAMES, [constant(2.0, 2.0)], [10])
    after = measure_gap(NAMES, [constant(3.0, 3.0)], [10])
    assert closed_fraction(before, after) == pytest.approx(1 - 16 / 6)


def test_only_a_prediction_that_is_better_for_certain_shows_shrinkage() -> None:
    before, after, worse = (
        measure_gap(NAMES, [constant(level, level)], [10]) for level in (2.0, 1.2, 3.0)
    )
    assert shows_shrinkage(before, after)
    assert not shows_shrinkage(before, worse)
    assert shows_shrinkage(after, after) is False
    nothing = measure_gap(NAMES, [constant(1.0, 1.0)], [10])
    assert shows_shrinkage(nothing, nothing)


def test_residual_below_the_noise_does_not_prove_that_nothing_is_left() -> None:
    """Its variance is 0.64, known to 2 %; 1.96 of that may be left: 1 - 0.039 / (6.25 - 1)."""
    before = measure_gap(NAMES[:1], [constant(2.0, 1.0)], [10])
    after = measure_gap(NAMES[:1], [constant(0.8, 1.0)], [10])
    assert closed_fraction(before, after) == 1.0
    found = closed_fraction_interval(before, after)
    assert found == (pytest.approx(1 - 0.0392 / (6.25 * 1.0392 - 1), abs=2e-3), 1.0)


def test_samples_of_all_runs_are_pooled() -> None:
    both = measure_gap(
        [measured_run("a"), measured_run("a")],
        [prediction(np.full(100, 3.0)), prediction(np.full(300, 1.0))],
        [10, 10],
    )
    assert both.by_channel == pytest.approx([np.sqrt((9 + 3) / 4)])


def test_samples_that_do_not_count_are_left_out() -> None:
    residual = np.full(100, 2.0)
    residual[:50] = 0.0
    found = measure_gap([measured_run("a")], [prediction(residual)], [10])
    assert found.by_channel == pytest.approx([2.0])


def test_channel_that_only_one_run_has_counts_there() -> None:
    found = measure_gap(
        [measured_run("a", "b"), measured_run("a")], [constant(2.0, 3.0), constant(1.0)], [10, 10]
    )
    assert found.channels == ("a", "b")
    assert found.by_channel == pytest.approx([np.sqrt(2.5), 3.0])


def first_order(random: np.random.Generator, memory: float, samples: int) -> Array:
    """x[t] = memory x[t - 1] + white noise, of variance 1; its squares remember memory^2."""
    start = random.standard_normal()
    driven = np.sqrt(1.0 - memory**2) * random.standard_normal(samples)
    return np.asarray(lfilter([1.0], [1.0, -memory], driven, zi=[memory * start])[0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("memory", "samples", "least"), [(0.0, 1850, 0.91), (0.9, 1850, 0.88), (0.97, 3000, 0.85)]
)
def test_interval_covers_the_truth_at_its_rate(memory: float, samples: int, least: float) -> None:
    """The truth from the variances: 1 - 0.69 / 3; 300 trials, a standard error of 0.013.

    The variance of the noise is known to 2 %.
    """
    random, hits = np.random.default_rng(0), 0
    for _ in range(300):
        misjudged = 1.0 + 0.01 * random.standard_normal()
        first, second = (misjudged * first_order(random, memory, samples) for _ in range(2))
        blocks = block_lengths([prediction(2.0 * first)])
        before = measure_gap([measured_run("a")], [prediction(2.0 * first)], blocks)
        after = measure_gap([measured_run("a")], [prediction(1.3 * second)], blocks)
        found = closed_fraction_interval(before, after)
        assert found is not None
        hits += found[0] <= 1 - 0.69 / 3 <= found[1]
    assert least <= hits / 300 <= 0.985


def test_effect_as_slow_as_the_run_leaves_ten_blocks() -> None:
    random = np.random.default_rng(0)
    ramp = np.linspace(-5.0, 5.0, 1850) + random.standard_normal(1850)
    assert block_lengths([prediction(ramp)]) == [185]


def test_offset_lengthens_no_block() -> None:
    """White noise about an offset has squares without memory."""
    random = np.random.default_rng(0)
    (length,) = block_lengths([prediction(5.0 + random.standard_normal(1850))])
    assert length <= 6


def test_interval_of_a_channel_that_one_run_of_many_has_is_finite() -> None:
    """In a tenth of that run only: a draw may miss it."""
    rare = np.zeros(100)
    rare[:10] = 3.0
    some = [constant(2.0)] * 5 + [prediction(np.full(100, 2.0), rare)]
    runs = [measured_run("a")] * 5 + [measured_run("a", "b")]
    before = measure_gap(runs, some, [10] * 6)
    found = closed_fraction_interval(before, before)
    assert found == pytest.approx((0.0, 0.0), abs=0.03)  # the noise is known to 2 %
    assert np.isfinite(combined_gap(before)).all()


def test_channel_without_held_out_samples_has_no_gap() -> None:
    found = measure_gap(NAMES, [constant(2.0, 0.0)], [10])
    assert found.channels == ("a",)


def test_gap_over_the_noise_is_that_of_the_pooled_squares() -> None:
    """Residuals of 1 at a noise of 1, and of 6 at a noise of 3: (1 + 36) / (1 + 9)."""
    runs = [measured_run("a"), measured_run("a", noise=3.0)]
    found = measure_gap(runs, [constant(1.0), constant(2.0)], [10, 10])
    assert found.by_channel == pytest.approx([np.sqrt(3.7)])
    assert found.noise == pytest.approx([np.sqrt(5.0)])


def test_combined_gap_is_the_rms_over_all_channels() -> None:
    value, low, high = combined_gap(measure_gap(NAMES, [constant(3.0, 1.0)], [10]))
    assert value == pytest.approx(np.sqrt(5.0))
    assert low == pytest.approx(high)  # nothing varies


def test_interval_reaches_from_fits_to_fewer_runs_to_the_fit_to_all() -> None:
    """They leave 2 and 1.5 times the noise of 3; the noise is known to 2 % of its variance.

    What the fit to all leaves may be noise up to 1.05: 1 - (2.25 / 1.05 - 1) / 8.
    """
    before, left, fitted = (measure_gap(NAMES[:1], [constant(x, 1.0)], [10]) for x in (3, 2, 1.5))
    gaps = {NOMINAL: before, (): before, ("wave",): left}
    moving = replace(NAMES[0], measured=np.tile(np.arange(100.0), (2, 1)))
    found = held_out_gap(gaps, [moving], ("wave",), before, fitted)
    assert found.closed_fraction == pytest.approx(1 - 3 / 8)
    # d(closed)/d(noise) = -(4 * 8 - 3 * 9) / 8^2 of the predictions
    # and -(2.143 * 8 - 1.143 * 9) / 8^2 of the fit
    low = 1 - 3 / 8 - 1.96 * 0.02 * 5 / 64
    high = 1 - 1.143 / 8 + 1.96 * 0.02 * 6.857 / 64
    assert found.closed_fraction_ci95 == pytest.approx((low, high), abs=5e-4)
