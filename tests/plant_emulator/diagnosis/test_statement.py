"""The sentence of a verdict."""

import pytest

from plant_emulator.diagnosis.decision.verdict import Decision, Deviation
from plant_emulator.diagnosis.report.statement import statement
from tests.plant_emulator.diagnosis.line import effect


def deviation(nominal: float, estimated: float) -> Deviation:
    return Deviation(
        name="drum_inertia",
        nominal=nominal,
        estimated=estimated,
        standard_error=1.0,
        unit="kg m^2",
        subsystem="drum",
        surprise=5.0,
    )


def sentence(
    *deviations: Deviation,
    effects: tuple[str, ...] = (),
    closed: float | None = None,
    subsystem: str | None = None,
    reason: str = "",
) -> str:
    """The statement of a decision: unknown with a reason, effect, or parameter."""
    kind = "unknown" if reason else "effect" if effects else "parameter" if deviations else "none"
    decision = Decision(kind=kind, effects=effects, deviations=deviations, reason=reason)  # type: ignore[arg-type]
    candidates = {name: effect(name) for name in effects}
    return statement(decision, candidates, closed, subsystem)


@pytest.mark.parametrize(
    ("deviations", "told"),
    [
        ([(300.0, 330.0)], "drum_inertia is +10.0 %; no"),
        ([(300.0, 285.0)] * 2, "drum_inertia is -5.0 % and 1 other parameter; no"),
        ([(300.0, 285.0)] * 3, "drum_inertia is -5.0 % and 2 other parameters; no"),
        ([(0.0, 12.5)], "drum_inertia is 12.50 kg m^2; no"),
    ],
)
def test_change_of_the_first_parameter_is_told(
    deviations: list[tuple[float, float]], told: str
) -> None:
    assert told in sentence(*(deviation(*pair) for pair in deviations))


def test_share_that_closes_is_told_where_there_is_one() -> None:
    assert sentence(effects=("kink",), closed=0.98).endswith(
        "; with it the held-out gap closes by 98 %."
    )
    assert sentence(effects=("kink", "wave"), closed=0.5).endswith(
        "; with them the held-out gap closes by 50 %."
    )
    assert "closes" not in sentence(effects=("kink",))


def test_unknown_cause_tells_its_reason_and_place() -> None:
    told = sentence(reason="nothing helps", subsystem="torque_sensor")
    assert told.endswith("unknown: nothing helps. It lies in the torque sensor.")
    assert sentence() == "The logs show no gap beyond the noise of the sensors."
