"""Two laws are the same where no run tells them apart."""

from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.diagnosis.missing_law.grammar import Factor, Term
from plant_emulator.diagnosis.missing_law.law_search import Law
from plant_emulator.diagnosis.missing_law.quantity import LawQuantity
from plant_emulator.diagnosis.missing_law.states import LawState

SPEED = LawState(
    name="gear speed",
    symbol="w",
    unit="rad/s",
    code="abs(s.gear_speed)",
    kind="level",
    values=[np.linspace(0.0, 6.0, 200), np.linspace(0.0, 4.0, 100)],
    time=[np.arange(200) * 0.01, np.arange(100) * 0.01],
)
LINEAR, ROOT = Term((Factor("linear", SPEED),)), Term((Factor("root", SPEED),))
ANGLE = replace(SPEED, name="angle", kind="angle")
TURN, SAME_TURN, OTHER_TURN = (Term((Factor("turn", ANGLE, k),)) for k in (2.0, 2.001, 3.0))
WIDE, NARROW = Term((Factor("bell", SPEED, 3.0),)), Term((Factor("bell", SPEED, 0.3),))


def law(*terms: tuple[float, Term], name: str = "friction") -> Law:
    quantity = LawQuantity(
        place="gear",
        name=name,
        unit="N m",
        hook="gear_speed_friction",
        states=(SPEED,),
    )
    return Law(
        quantity=quantity,
        terms=tuple(term for _, term in terms),
        coefficients=tuple(size for size, _ in terms),
        errors=(0.0,) * len(terms),
        gain=1.0,
        nuisance=(),
    )


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (law((2.0, LINEAR)), law((2.1, LINEAR), (9.0, Term(()))), True),
        (law((2.0, LINEAR)), law((2.0, LINEAR), (0.02, ROOT)), True),
        (law((2.0, LINEAR)), law((2.0, ROOT)), False),
        (law((2.0, LINEAR)), law((2.0, LINEAR), name="torque"), False),
        (law((2.0, TURN)), law((2.1, SAME_TURN)), True),
        (law((2.0, TURN)), law((2.0, OTHER_TURN)), False),
        (law((2.0, WIDE), (1.0, ROOT)), law((2.0, NARROW), (1.0, LINEAR)), False),
    ],
)
def test_laws_resemble_each_other_by_their_shape(one: Law, other: Law, same: bool) -> None:
    assert one.resembles(other) is same
    assert other.resembles(one) is same
