"""The noise model against noise of known spectrum; expected values from theory."""

from __future__ import annotations

import numpy as np
import pytest

from plant_emulator.estimation.noise.autoregression import (
    autocovariance,
    levinson,
    samples_since_break,
)
from plant_emulator.estimation.noise.channel_noise import LAGS, ljung_box_excess
from plant_emulator.estimation.noise.disturbances import outlying
from plant_emulator.estimation.noise.estimate import estimate_channel_noise
from plant_emulator.estimation.noise.logged_noise import disturbances_of_runs
from plant_emulator.signals.noise import NoiseSeries

RATE = 100.0


def series(value: np.ndarray, use: np.ndarray | None = None) -> NoiseSeries:
    n = len(value)
    return NoiseSeries(
        time=np.arange(n) / RATE,
        value=value,
        use=np.ones(n, bool) if use is None else use,
    )


def first_order(n: int, pole: float, seed: int) -> np.ndarray:
    """AR(1) noise of variance 1."""
    draw = np.random.default_rng(seed).standard_normal(n)
    found = np.empty(n)
    found[0] = draw[0]
    for k in range(1, n):
        found[k] = pole * found[k - 1] + np.sqrt(1.0 - pole**2) * draw[k]
    return found


def white(n: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(n)


def test_white_noise_keeps_its_deviation_and_gets_no_colour() -> None:
    noise, (whitener,) = estimate_channel_noise([series(white(5000, 1))])
    assert noise.colour.order == 0
    assert noise.lines == ()
    assert noise.deviation == pytest.approx(1.0, abs=4.0 / np.sqrt(2 * 5000))
    assert np.mean(whitener.white(white(5000, 2)) ** 2) == pytest.approx(1.0, abs=0.1)


def test_levinson_finds_the_pole_of_a_first_order_process() -> None:
    predictors, variances = levinson(0.7 ** np.arange(4.0))
    assert predictors[1] == pytest.approx([0.7])
    assert predictors[3] == pytest.approx([0.7, 0.0, 0.0], abs=1e-12)
    assert variances == pytest.approx([1.0, 0.51, 0.51, 0.51])


def test_noise_correlated_over_30_ms_is_whitened_and_keeps_its_whole_deviation() -> None:
    pole = float(np.exp(-0.01 / 0.03))
    noise, _ = estimate_channel_noise([series(first_order(5000, pole, seed)) for seed in (3, 4, 5)])
    assert noise.colour.predictors[-1][0] == pytest.approx(pole, abs=0.05)
    assert noise.deviation == pytest.approx(1.0, abs=0.06)
    assert noise.colour.innovation_deviation == pytest.approx(np.sqrt(1.0 - pole**2), abs=0.03)
    assert noise.colour.correlation_time == pytest.approx((1.0 + pole) / (1.0 - pole), rel=0.2)
    assert abs(noise.ljung_box_excess) < 5.0 * np.sqrt(2.0 * LAGS)


def test_spectrum_is_that_of_the_process() -> None:
    pole = 0.7
    noise, _ = estimate_channel_noise([series(first_order(20000, pole, 6))])
    frequency = np.array([1.0, 10.0, 40.0])
    turn = np.exp(-2j * np.pi * frequency / RATE)
    theory = 2.0 / RATE * (1.0 - pole**2) / np.abs(1.0 - pole * turn) ** 2
    assert noise.colour.spectrum(frequency, 1.0 / RATE) == pytest.approx(theory, rel=0.25)


def test_mains_are_found_where_the_sampling_folds_them() -> None:
    runs = []
    for seed in (7, 8):
        value = white(5000, seed)
        t = np.arange(5000) / RATE
        value += 1.5 * np.sqrt(2.0) * np.cos(2 * np.pi * 49.98 * t + seed)
        value += np.sqrt(2.0) * np.cos(2 * np.pi * 99.96 * t + 2 * seed)
        runs.append(series(value))
    noise, whiteners = estimate_channel_noise(runs)
    assert noise.lines[0] == pytest.approx(49.98, abs=0.02) or noise.lines[0] == pytest.approx(
        50.02, abs=0.02
    )
    assert noise.deviation == pytest.approx(1.0, abs=0.1)
    left = np.concatenate([w.white(s.value) for w, s in zip(whiteners, runs, strict=True)])
    assert np.mean(left**2) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("mains", [49.971, 49.992, 50.024, 60.013])
def test_mains_are_found_to_a_hundredth_of_a_turn(mains: float) -> None:
    """Near half the sampling rate, where the line and its mirror image stand side by side."""
    value, t = white(4000, 19), np.arange(4000) / RATE
    value += 2.0 * np.cos(2 * np.pi * mains * t + 1.0) + 1.5 * np.cos(4 * np.pi * mains * t + 2.0)
    noise, _ = estimate_channel_noise([series(value)])
    mirrored = min(abs(noise.lines[0] - mains), abs(100.0 - noise.lines[0] - mains))
    assert mirrored * 40.0 < 0.015
    assert noise.colour.order == 0


def test_single_spikes_are_left_out_and_counted() -> None:
    value = white(5000, 9)
    places = np.arange(100, 4900, 320)
    value[places] += 20.0
    use = np.ones(5000, bool)
    assert set(np.flatnonzero(outlying(value, use))) == set(places)
    noise, (whitener,) = estimate_channel_noise([series(value)])
    assert noise.outliers == pytest.approx(len(places) / 5000)
    assert noise.deviation == pytest.approx(1.0, abs=0.06)
    assert not whitener.white(value)[places].any()


def test_spikes_that_strike_neighbours_are_outliers_beside_single_ones() -> None:
    value, use = white(5000, 9), np.ones(5000, bool)
    value[[700, 701]] += [30.0, -25.0]
    value[[2500, 2501]] += [22.0, 28.0]
    assert not outlying(value, use).any()
    places = [100, 900, 3000]
    value[places] += 20.0
    assert set(np.flatnonzero(outlying(value, use))) == {*places, 700, 701, 2500, 2501}


def test_a_burst_of_several_samples_is_no_outlier() -> None:
    value = white(2000, 10)
    value[500:510] += 20.0 * np.sin(np.pi * np.arange(1, 11) / 11)
    assert not outlying(value, np.ones(2000, bool))[500:510].any()


def test_a_hole_breaks_the_series() -> None:
    assert samples_since_break(np.array([0.0, 1.0, 2.0, 5.0, 6.0])).tolist() == [0, 1, 2, 0, 1]


def test_lost_and_held_samples_leave_the_others_white() -> None:
    value = first_order(9000, 0.8, 12)
    use = np.zeros(9000, bool)
    use[::3] = True
    use[3000:3050] = False
    noise, (whitener,) = estimate_channel_noise([series(value, use=use)])
    assert noise.colour.predictors[-1][0] == pytest.approx(0.8**3, abs=0.07)
    left = whitener.white(value)
    assert not left[~use].any()
    assert np.mean(left[use] ** 2) == pytest.approx(1.0, abs=0.1)


def test_slow_wander_beside_white_noise_is_whitened() -> None:
    pole = float(np.exp(-0.01 / 3.0))
    runs = [
        series(white(5000, seed) + first_order(5000, pole, 100 + seed)) for seed in (13, 14, 15)
    ]
    noise, whiteners = estimate_channel_noise(runs)
    left = np.concatenate([w.white(s.value) for w, s in zip(whiteners, runs, strict=True)])
    assert noise.colour.order > 12
    assert abs(noise.ljung_box_excess) < 10.0 * np.sqrt(2.0 * LAGS)
    assert np.mean(left**2) == pytest.approx(1.0, abs=0.05)


def test_a_cause_that_acts_at_times_does_not_pass_for_noise() -> None:
    value = first_order(6000, 0.7, 16)
    moving = (np.arange(6000) // 600) % 3 == 1
    value[moving] += 4.0 * np.sin(np.arange(6000)[moving] / 7.0)
    noise, (whitener,) = estimate_channel_noise([series(value)])
    assert noise.deviation == pytest.approx(1.0, abs=0.1)
    assert noise.unsteady == pytest.approx(1.0 / 3.0, abs=0.1)
    assert np.mean(whitener.white(value)[~moving] ** 2) == pytest.approx(1.0, abs=0.1)


def test_steady_noise_has_no_loud_blocks() -> None:
    noise, _ = estimate_channel_noise([series(first_order(6000, 0.7, 17))])
    assert noise.unsteady == 0.0


def test_a_run_shorter_than_a_lag_adds_nothing_to_its_autocovariance() -> None:
    long, short = np.ones(40), np.ones(3)
    known = [np.arange(40), np.arange(3)]
    alone = autocovariance([long], known[:1], 10)
    assert autocovariance([long, short], known, 10) == pytest.approx(alone)


def test_coarse_channel_that_stands_still_keeps_the_noise_of_its_motion() -> None:
    value = white(6000, 18)
    value[:3600] = 0.0
    noise, (whitener,) = estimate_channel_noise([series(value)])
    assert noise.deviation == pytest.approx(1.0, abs=0.06)
    assert np.mean(whitener.white(value)[3600:] ** 2) == pytest.approx(1.0, abs=0.1)


def test_channel_without_noise_is_whitened_by_the_least_that_there_is() -> None:
    noise, (whitener,) = estimate_channel_noise([series(np.zeros(2000))])
    assert noise.deviation == pytest.approx(0.1)
    assert np.isfinite(whitener.white(np.ones(2000))).all()


def test_levinson_ends_where_no_process_has_such_an_autocovariance() -> None:
    """By hand: 1 and 0.5 leave 0.75; -1 at a lag of 2 would need a reflection of -1.67."""
    predictors, variances = levinson(np.array([1.0, 0.5, -1.0, 0.3]))
    assert variances == pytest.approx([1.0, 0.75])
    assert len(predictors) == 2


def test_whiteness_is_told_beside_a_run_that_is_too_short_for_its_lags() -> None:
    """A run of fewer samples than lags has no product at the largest one; the others tell all."""
    long = np.random.default_rng(5).normal(size=2000)
    short = long[: LAGS - 3]
    assert ljung_box_excess([long, short]) == ljung_box_excess([long])
    assert ljung_box_excess([short]) == 0.0


def test_each_run_has_mains_of_its_own() -> None:
    """At 100 Hz the double folds to 0.06 and 0.04 Hz: five waves in one run, three in the other."""
    runs, t = [], np.arange(8000) / RATE
    for seed, mains in ((23, 50.03), (24, 49.98)):
        value = white(8000, seed) + 1.5 * np.cos(2 * np.pi * mains * t + 1.0)
        runs.append(series(value + 0.75 * np.cos(4 * np.pi * mains * t + 2.0)))
    noise, whiteners = estimate_channel_noise(runs)
    folded = [abs(w.lines[0] - 50.0) for w in whiteners]
    assert folded == pytest.approx([0.03, 0.02], abs=0.002)
    assert noise.colour.order == 0
    left = np.concatenate([w.white(s.value) for w, s in zip(whiteners, runs, strict=True)])
    assert np.mean(left**2) == pytest.approx(1.0, abs=0.05)


def test_outliers_leave_the_declared_noise() -> None:
    value = white(4000, 25)
    value[100::400] += 25.0
    found = disturbances_of_runs([(0, "torque", series(value))])
    assert found.channels["torque"].outliers == pytest.approx(10 / 4000)
    (left,) = found.whitened(0, lambda _: value[None])({})
    assert not left[100::400].any()
    assert left[1] == value[1]


def test_what_shakes_often_is_no_outlier() -> None:
    value = white(4000, 26)
    value[10::20] += 25.0
    assert disturbances_of_runs([(0, "torque", series(value))]).channels["torque"].outliers == 0.0
