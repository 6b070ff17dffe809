"""Parts of the answer of a diagnosis, checked by hand."""

from dataclasses import replace

from plant_emulator.diagnosis.answer import ranked
from plant_emulator.diagnosis.contest import Point
from plant_emulator.diagnosis.explain import Contender, Explanation

POINT = Point(
    effects=(),
    values={},
    states=({},),
    cost=1000.0,
    squares=1000.0,
    samples=1000,
    share=1.0,
    errors={},
    converged=True,
)


def contender(effect: str, fall: float) -> Contender:
    """An effect that alone lowers the cost by so much."""
    point = replace(POINT, effects=(effect,), cost=POINT.cost - fall)
    return Contender(effect=effect, norm=10.0, raw=10.0, imitated_by="a", point=point)


def explanation(falls: dict[str, float], accepted: tuple[str, ...]) -> Explanation:
    return Explanation(
        null=POINT,
        final=replace(POINT, effects=accepted),
        contenders=tuple(contender(name, fall) for name, fall in falls.items()),
        rivals={},
        unconverged="",
    )


def test_accepted_effect_without_evidence_alone_is_ranked() -> None:
    """f shows beside a only: alone it lowers the cost least of all."""
    falls = {"f": 1.0, "a": 300.0, "b": 20.0, "c": 15.0, "d": 10.0, "e": 5.0}
    names = [c.effect for c in ranked(explanation(falls, ("a", "f")))]
    assert names == ["a", "b", "c", "d", "e", "f"]


def test_effects_of_no_account_beyond_a_few_are_not_ranked() -> None:
    falls = {"f": 1.0, "a": 300.0, "b": 20.0, "c": 15.0, "d": 10.0, "e": 5.0}
    names = [c.effect for c in ranked(explanation(falls, ("a",)))]
    assert names == ["a", "b", "c", "d", "e"]
