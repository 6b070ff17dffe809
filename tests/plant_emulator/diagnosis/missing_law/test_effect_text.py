"""A drafted law as an effect file: it loads, is absent at neutral, and gives the law's value."""

from math import exp
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from plant_emulator import effects
from plant_emulator.diagnosis.missing_law.effect_text import effect_text
from plant_emulator.diagnosis.missing_law.grammar import Factor, Term
from plant_emulator.diagnosis.missing_law.law_search import Law
from plant_emulator.diagnosis.missing_law.quantity import LawQuantity
from plant_emulator.diagnosis.missing_law.states import LawState
from plant_emulator.effects import Effect


def state(**known: Any) -> LawState:
    common = {"name": "speed", "symbol": "w", "unit": "rad/s", "values": [np.ones(2)]}
    return LawState(**{**common, "time": [np.arange(2.0)], **known})


SPEED = state(code="abs(s.gear_speed)", kind="level")
DRUM_SPEED = state(code="abs(s.drum_speed)", kind="level")
TORQUE = state(code="value", kind="signed", name="shaft torque", symbol="T", unit="N m")
ANGLE = state(code="s.drum_speed", kind="angle", name="angle", symbol="theta", unit="rad")


def written(folder: Path, hook: str, *terms: tuple[float, Term]) -> Effect:
    quantity = LawQuantity(
        place="gear",
        name="friction",
        unit="N m",
        hook=hook,
        states=(DRUM_SPEED,),
    )
    law = Law(
        quantity=quantity,
        terms=tuple(term for _, term in terms),
        coefficients=tuple(size for size, _ in terms),
        errors=(0.0,) * len(terms),
        gain=1.0,
        nuisance=(),
    )
    path = folder / "draft.py"
    path.write_text(effect_text("draft", law))
    return effects.from_file(path)


def values(effect: Effect, *, neutral: bool = False, **others: float) -> Any:
    own = {
        f"draft_{key}": p.neutral if neutral else p.plausible
        for key, p in effect.parameters.items()
    }
    return SimpleNamespace(**{**own, **others})


def test_law_of_two_terms_adds_their_value_and_is_absent_at_neutral(tmp_path: Path) -> None:
    effect = written(
        tmp_path,
        "gear_speed_friction",
        (-31.0, Term((Factor("bell", SPEED, 0.4),))),
        (2.0, Term((Factor("linear", SPEED),))),
    )
    law, s = effect.laws["gear_speed_friction"], SimpleNamespace(gear_speed=-0.2)
    assert law(5.0, s, values(effect)) == pytest.approx(5.0 - 31.0 * exp(-0.25) + 0.4)
    assert law(5.0, s, values(effect, neutral=True)) == 5.0


def test_friction_that_vanishes_at_rest_is_viscous_and_the_rest_is_coulomb(tmp_path: Path) -> None:
    effect = written(
        tmp_path,
        "drum_coulomb_friction",
        (25.0, Term(())),
        (6.0, Term((Factor("linear", DRUM_SPEED),))),
    )
    s = SimpleNamespace(drum_speed=-3.0)
    assert effect.laws["drum_coulomb_friction"](0.0, s, values(effect)) == 25.0
    assert effect.laws["drum_viscous_friction"](0.0, s, values(effect)) == pytest.approx(6.0)


def test_delay_follows_its_own_law_with_its_time_constant(tmp_path: Path) -> None:
    effect = written(
        tmp_path, "measured_shaft_torque", (1.0, Term((Factor("delay", TORQUE, 0.1),)))
    )
    memory = effect.memories["memory11"]
    assert memory.follows == "measured_shaft_torque"
    shown = 0.0
    for _ in range(1000):  # 0.1 s in implicit steps
        shown = memory.advance(shown, 1e-4, 8.0, SimpleNamespace(), values(effect))
    assert shown == pytest.approx(8.0 * (1.0 - exp(-1.0)), rel=1e-3)
    s = SimpleNamespace(draft_memory11=shown)
    assert effect.laws["measured_shaft_torque"](8.0, s, values(effect)) == pytest.approx(shown)


def test_play_shows_a_change_only_beyond_half_its_width(tmp_path: Path) -> None:
    effect = written(tmp_path, "measured_shaft_torque", (1.0, Term((Factor("play", TORQUE, 2.0),))))
    memory, shown = effect.memories["memory11"], []
    assert memory.follows == "measured_shaft_torque"
    for torque in (1.0, 5.0, 4.0, 1.0, -3.0):
        base = shown[-1] if shown else 0.0
        shown.append(memory.advance(base, 1e-4, torque, SimpleNamespace(), values(effect)))
    assert shown == [0.0, 3.0, 3.0, 3.0, -1.0]
    s = SimpleNamespace(draft_memory11=3.0)
    assert effect.laws["measured_shaft_torque"](4.0, s, values(effect)) == pytest.approx(3.0)


def test_turn_has_an_angle_and_a_phase_of_each_run(tmp_path: Path) -> None:
    effect = written(tmp_path, "drum_torque", (10.0, Term((Factor("turn", ANGLE, 2.0),))))
    assert effect.parameters["phase11"].per_run
    angle = effect.memories["memory11"].advance(1.0, 0.1, SimpleNamespace(drum_speed=2.0), None)
    assert angle == pytest.approx(1.2)
    found = effect.laws["drum_torque"](0.0, SimpleNamespace(draft_memory11=0.0), values(effect))
    assert found == pytest.approx(10.0)
