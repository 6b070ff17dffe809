"""`tools/demo gap`: what it hides, that nobody can change it afterwards, and the whole loop."""

import hashlib
import json
from dataclasses import replace

import pytest
from click.testing import CliRunner

from gateway.demo import gap
from gateway.demo.seal import SIZES, draw
from gateway.friction.document import EFFECTS, SENSOR
from plant_emulator import effects
from tools.gap import main

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


@pytest.mark.slow
@pytest.mark.realtime
def test_a_hidden_offset_is_driven_named_and_taken_out_of_the_force(tmp_path, monkeypatch):
    """Seed 19: 0.43 N m of 0.645 m and 62.6 are 42 N at the rim; one program instead of two."""
    monkeypatch.setattr(gap, "PROGRAMS", ("program1",))
    result = CliRunner().invoke(main, ["--seed", "19", "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    left = tmp_path / "seed_19"
    told = json.loads((left / "summary.json").read_text())
    seal = (left / "seal.json").read_text()
    assert hashlib.sha256(seal.encode()).hexdigest() == told["truth"]["sha256"]
    assert f"sealed: sha256 {told['truth']['sha256']}" in result.output.splitlines()[0]
    assert told["verdict"]["effects"] == ["torque_sensor_offset"]
    assert told["gap_closed"] > 0.5
    before, after = told["force"]["before"], told["force"]["after"]
    assert before["mean_error"] == pytest.approx(-42.0, abs=6.0)
    assert abs(after["mean_error"]) < 0.03 * after["target"]
    for name in ("gap.png", "diagnosis.html", "set.toml"):
        assert (left / name).stat().st_size
