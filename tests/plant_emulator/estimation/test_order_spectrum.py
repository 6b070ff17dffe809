"""Order analysis finds the waves a turn, and takes no noise for a ripple."""

import numpy as np
import pytest
from scipy.stats import gamma

from plant_emulator.estimation.order_spectrum import CHANCE, Ripple, TurningRun, strongest_ripple


def run(seconds: float = 40.0, seed: int = 1, **more: object) -> TurningRun:
    """White noise of a part that speeds up from rest to two turns a second, 100 samples a second.

    more : turns and residual as functions of time, the residual beside the noise
    """
    time = np.arange(0.0, seconds, 0.01)
    turns = more.get("turns", lambda t: t**2 / seconds)(time)  # type: ignore[operator]
    noise = np.random.default_rng(seed).standard_normal(len(time))
    beside = more.get("residual", lambda _time, _turns: 0.0)(time, turns)  # type: ignore[operator]
    return TurningRun(time=time, turns=turns, residual=noise + beside)


def cruise(time: np.ndarray) -> np.ndarray:
    """Turns of a part that rests for 10 s, speeds up for 5 s and then turns once a second."""
    speed = np.clip((time - 10.0) / 5.0, 0.0, 1.0)
    return np.cumsum(speed) * 0.01


def found(*runs: TurningRun) -> Ripple:
    ripple = strongest_ripple(runs, 0.5, 120.0)
    assert ripple is not None
    return ripple


@pytest.mark.parametrize("order", [4.12, 62.6, 118.3])
def test_wave_of_any_speed_is_found_with_its_squares(order: float) -> None:
    """A wave of amplitude a holds n a^2 / 2 squares, over the variance of all; near the highest
    order the grid keeps 0.9 of them, and 0.8 between two orders of it.
    """
    runs = [
        run(
            seed=seed,
            residual=lambda _, n, seed=seed: 0.5 * np.cos(2.0 * np.pi * order * n + seed),
        )
        for seed in (1, 2)
    ]
    ripple = found(*runs)
    assert ripple.order == pytest.approx(order, abs=0.5 / 80.0)
    assert ripple.squares > ripple.by_noise
    squares = sum(len(r.time) * 0.5**2 / 2.0 / np.mean(r.residual**2) for r in runs)
    assert 0.7 * squares < ripple.squares < 1.1 * squares


@pytest.mark.parametrize("count", [1, 3])
def test_strongest_order_of_white_noise_is_as_large_as_extreme_values_are(count: int) -> None:
    """S of so many runs is a gamma variable; of 40 turns times 119.5 orders the largest one has the
    median that all of them stay below with a probability of one half.
    """
    ripples = [found(*(run(seed=100 * k + j) for j in range(count))) for k in range(60)]
    median = np.median([one.squares for one in ripples])
    independent = 40.0 * 119.5
    expected = 2.0 * gamma.isf(1.0 - 0.5 ** (1.0 / independent), count)
    assert median == pytest.approx(expected, abs=2.5)
    white = 2.0 * gamma.isf(CHANCE / (2.0 * independent), count)
    assert min(one.by_noise for one in ripples) == pytest.approx(white, abs=0.1)
    assert not any(one.squares > one.by_noise for one in ripples)


@pytest.mark.parametrize(
    "residual",
    [
        lambda time, _: 0.3 * np.sin(2.0 * np.pi * 3.0 * time),  # a wave of time
        lambda time, _: 0.2 + 0.0 * time,  # an offset
        lambda time, _: 0.4 * np.sin(2.0 * np.pi * time / 47.0),  # drift
        lambda time, turns: np.where(turns == 0.0, 0.5, 0.0),  # an offset at rest
    ],
)
def test_slow_noise_and_waves_of_time_are_no_ripple_in_a_cruise(residual: object) -> None:
    """At one speed each wave of time is an order, and a sample at rest is in phase with the next:
    at 100 samples a second and one turn a second an offset has the order 100.
    """
    for seed in range(5):
        ripple = found(run(60.0, seed, turns=cruise, residual=residual))
        assert ripple.squares < ripple.by_noise


def test_ripple_at_one_speed_is_told_from_no_wave_of_time() -> None:
    wave = run(
        60.0,
        turns=lambda time: time + 0.0,
        residual=lambda _, n: 0.5 * np.cos(2.0 * np.pi * 7.0 * n),
    )
    ripple = found(wave)
    assert ripple.order == pytest.approx(7.0, abs=0.05)
    assert ripple.squares < ripple.by_noise


def test_run_that_hardly_turns_shows_nothing() -> None:
    time = np.arange(0.0, 5.0, 0.01)
    for turns, residual in (
        (0.3 * time, np.ones(500)),
        (0.0 * time, np.ones(500)),
        (3.0 * time, np.zeros(500)),
    ):
        one = TurningRun(time=time, turns=turns, residual=residual)
        assert strongest_ripple([one], 0.5, 20.0) is None
    empty = TurningRun(time=np.zeros(0), turns=np.zeros(0), residual=np.zeros(0))
    assert strongest_ripple([empty], 0.5, 20.0) is None
