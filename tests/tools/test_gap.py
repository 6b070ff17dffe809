"""The seal of `tools/demo gap`: what it hides, and that nobody can change it afterwards."""

import hashlib
import json
from dataclasses import replace

import pytest

from gateway.demo.seal import SIZES, draw
from gateway.friction.document import EFFECTS, SENSOR
from plant_emulator import effects

SEEDS = range(200)


def test_a_seed_draws_the_same_truth_again_and_seeds_draw_every_effect():
    assert draw(3) == draw(3)
    assert {draw(seed).effect for seed in SEEDS} == set(SIZES)


def test_the_seal_is_the_sha256_of_the_text_that_is_told_afterwards():
    truth = draw(1)
    assert truth.seal == hashlib.sha256(truth.text.encode()).hexdigest()
    assert json.loads(truth.text)["effect"] == truth.effect
    assert replace(truth, value=truth.value + 1e-5).seal != truth.seal


def test_a_seal_does_not_tell_the_truth_to_who_hashes_all_truths():
    assert len({draw(seed).salt for seed in SEEDS}) == len(SEEDS)


@pytest.mark.parametrize("name", SIZES)
def test_a_hidden_effect_is_one_of_the_library_that_the_regulator_can_use(name):
    parameter, low, high = SIZES[name]
    declared = effects.load(name).parameters[parameter]
    assert declared.lower < low < high < declared.upper
    assert name in EFFECTS | SENSOR
