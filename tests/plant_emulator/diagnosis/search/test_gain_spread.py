"""The gain that counts as far as enough samples share it, by hand."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.search.gain_spread import Pair, shared_gain
from plant_emulator.signals.log import Array
from tests.plant_emulator.diagnosis.line import SHAPES, TIME, Line, explained, noisy

BASE = {"a": 0.0, "b": 0.0}


def spikes(at: Sequence[int]) -> Array:
    """1 at these samples."""
    found = np.zeros_like(TIME)
    found[list(at)] = 1.0
    return found


def gain_of(measured: Array, shape: Array, monkeypatch: pytest.MonkeyPatch) -> float:
    """What an effect of size 1 and of this shape gains."""
    monkeypatch.setitem(SHAPES, "spikes", lambda _: shape)
    model = Line([measured], ("spikes",))
    smaller = replace(fit_null(Line([noisy(TIME)]), (0,)), values=BASE)
    larger = replace(smaller, effects=("spikes",), values={**BASE, "spikes_size": 1.0})
    return shared_gain(model, Pair(larger, smaller, (0,)))


@pytest.mark.parametrize("count", [1, 30])
def test_samples_that_gain_the_same_count_twice_each(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By hand: n samples of gain g have 2 (n g)^2 / (n g^2) = 2 n, whatever they are off by."""
    for size in (1.0, 1000.0):
        shape = size * spikes(range(0, 60 * count, 60))
        assert gain_of(shape, shape, monkeypatch) == pytest.approx(2.0 * count)
        assert gain_of(0.0 * shape, shape, monkeypatch) == pytest.approx(-2.0 * count)


def test_small_shares_of_many_samples_gain_what_they_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half the sum of squares of a wave of 0.3 in noise of 1: 0.5 * 0.3^2 * 2000 / 2 = 45.

    Student's t tells 5 of 7 parts of it (the information of a location), whose spread is less too.
    """
    wave = 0.3 * SHAPES["wave"](TIME)
    gains = [gain_of(noisy(wave, seed), wave, monkeypatch) for seed in range(40)]
    assert np.median(gains) == pytest.approx(45.0, rel=0.25)


@pytest.mark.parametrize(("count", "named"), [(3, ()), (30, ("spikes",))])
def test_an_effect_that_repairs_a_few_samples_is_not_named(
    count: int, named: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Samples that are off by 8 noises gain 32 nats each, and need 15 in all."""
    shape = 8.0 * spikes(range(30, 60 * count, 60))
    monkeypatch.setitem(SHAPES, "spikes", lambda _: shape)
    model = Line([noisy(2.0 * TIME + shape)], ("spikes",))
    found = explained(model)
    assert found.final.effects == named
    few = [step.effects for step in found.trace if "few samples" in step.action]
    assert few == ([] if named else [("spikes",)])
