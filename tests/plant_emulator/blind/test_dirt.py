"""The dirt of a case: what was asked for is what the log shows; nothing else changes."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from plant_emulator.blind.dirt import (
    HELD_CHANNELS,
    RANGES,
    Dirt,
    DirtKind,
    draw_dirt,
    soil,
    take_rows,
    whiten,
)
from plant_emulator.blind.sealing import seal, unseal
from plant_emulator.signals.log import COMPARED, Log
from plant_emulator.simulation.sensor_noise import SENSORS
from tests.plant_emulator.blind.conftest import case_with

TIME = np.arange(0.0, 40.0, 0.01)


@pytest.fixture
def clean() -> Log:
    """A log whose signals rise steadily."""
    signals = dict.fromkeys(COMPARED, 10.0 * TIME)
    return Log(TIME, {"speed_reference": 10.0 * TIME, **signals})


def change(clean: Log, kind: DirtKind, size: float, name: str = "shaft_torque") -> np.ndarray:
    """Change of a channel over its noise."""
    soiled = soil(clean, Dirt(kind=kind, size=size), 1)
    return (soiled[name] - clean[name]) / SENSORS[name][0]


def test_half_of_the_cases_are_clean_and_all_kinds_come_up() -> None:
    drawn = [draw_dirt(1, number) for number in range(400)]
    assert 160 < sum(one is None for one in drawn) < 240
    assert set(Counter(one.kind for one in drawn if one)) == set(get_args(DirtKind))
    assert all(RANGES[d.kind][0] <= d.size <= RANGES[d.kind][1] for d in drawn if d)


def test_coloured_noise_has_its_time_constant(clean: Log) -> None:
    noise = change(clean, "colour", 0.03)
    assert np.std(noise) == pytest.approx(2.0, rel=0.15)
    assert np.corrcoef(noise[3:], noise[:-3])[0, 1] == pytest.approx(np.exp(-1.0), abs=0.1)


def test_what_colour_adds_is_whitened() -> None:
    """White noise of 1 beside colour of 2: variance 5, and 4 exp(-1/3) to the next sample."""
    still = Log(TIME, dict.fromkeys((*COMPARED, "speed_reference"), np.zeros(len(TIME))))
    levels = np.array([SENSORS[name][0] for name in COMPARED])
    white = np.random.default_rng(0).standard_normal((len(COMPARED), len(TIME)))
    soiled = soil(still, Dirt(kind="colour", size=0.03), 1)
    rows = np.stack([soiled[name] for name in COMPARED]) + white * levels[:, None]
    assert np.mean(rows[0] ** 2) / levels[0] ** 2 == pytest.approx(5.0, rel=0.2)
    for row in whiten(rows, TIME, levels, Dirt(kind="colour", size=0.03)):
        assert np.mean(row**2) == pytest.approx(1.0, rel=0.08)
        for lag in (1, 2, 5):
            assert abs(np.corrcoef(row[lag:], row[:-lag])[0, 1]) < 0.06


def test_change_counts_for_what_dirt_leaves_of_it() -> None:
    levels = np.array([SENSORS[name][0] for name in COMPARED])
    rows = np.repeat(levels[:, None], len(TIME), axis=1)

    def square(kind: DirtKind, size: float, channel: int) -> float:
        found = whiten(rows, TIME, levels, Dirt(kind=kind, size=size))
        return float(np.mean(found[channel] ** 2))

    # By hand: a step of 3 adds 9 / 12 of variance; of values held for 4 samples one is new.
    assert square("coarse", 3.0, 0) == pytest.approx(1.0 / 1.75)
    held = [COMPARED.index(name) for name in HELD_CHANNELS]
    for channel in range(len(COMPARED)):
        expected = 0.25 if channel in held else 1.0
        assert square("held", 4.0, channel) == pytest.approx(expected)
    # A slow change counts for little beside the spectrum of noise at zero: 1 + 4 (1 + p) / (1 - p).
    pole = np.exp(-1.0 / 3.0)
    expected = 1.0 / (1.0 + 4.0 * (1.0 + pole) / (1.0 - pole))
    assert square("colour", 0.03, 0) == pytest.approx(expected, rel=0.05)


def test_hum_has_its_amplitude_where_it_is_expected(clean: Log) -> None:
    # Cosines of 2 and 1 have a mean square of 2.5 together.
    assert np.std(change(clean, "hum", 2.0)) == pytest.approx(np.sqrt(2.5), rel=0.3)
    assert not change(clean, "hum", 2.0, "motor_speed").any()


def test_spikes_are_as_rare_as_asked_for(clean: Log) -> None:
    spikes = change(clean, "spikes", 5e-3)
    assert np.count_nonzero(spikes) == pytest.approx(20, abs=14)
    assert np.min(np.abs(spikes[spikes != 0.0])) >= 15.0


def test_held_channel_is_new_at_its_period(clean: Log) -> None:
    held = soil(clean, Dirt(kind="held", size=3.0), 1)["drum_speed"]
    assert np.flatnonzero(np.diff(held) != 0.0)[:3].tolist() == [2, 5, 8]


def test_coarse_values_are_multiples_of_the_quantum(clean: Log) -> None:
    soiled = soil(clean, Dirt(kind="coarse", size=2.0), 1)["shaft_torque"]
    counts = soiled / (2.0 * SENSORS["shaft_torque"][0])
    assert counts == pytest.approx(np.round(counts), abs=1e-9)


def test_rows_off_their_stamps_are_off_in_all_channels_alike(clean: Log) -> None:
    soiled = take_rows(clean, clean.time, 2e-3, 1)
    off = (soiled["speed_reference"] - clean["speed_reference"]) / 10.0
    assert np.max(np.abs(off)) <= 2e-3
    assert np.std(off[1:-1]) == pytest.approx(2e-3 / np.sqrt(3.0), rel=0.1)
    assert soiled["shaft_torque"] == pytest.approx(soiled["speed_reference"])


def test_lost_rows_and_a_hole_are_gone_and_the_others_stay(clean: Log) -> None:
    soiled = soil(clean, Dirt(kind="lost", size=0.02), 1)
    steps = np.diff(soiled.time)
    assert 0.1 <= np.max(steps) <= 0.55
    assert len(soiled.time) < 0.99 * len(TIME)
    assert soiled["drum_speed"] == pytest.approx(10.0 * soiled.time)


def test_dirt_is_sealed_with_its_case() -> None:
    case = replace(case_with(kind="none"), dirt=Dirt(kind="hum", size=2.0))
    text, commitment = seal(case, "nonce")
    assert unseal(text, commitment, "case").dirt == case.dirt
