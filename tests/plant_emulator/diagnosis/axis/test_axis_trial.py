"""The independent axes of the trial are axes, and an answer is scored as the page says."""

import numpy as np
import pytest

from plant_emulator.diagnosis.axis.effects import NAMES
from tests.plant_emulator import axis_trial
from tests.plant_emulator.axis_simulation import STEP, Axis, Drive, run


def test_52_seeds_hide_every_effect_twice_and_none_in_20() -> None:
    cases = [axis_trial.case(seed) for seed in range(1001, 1053)]
    hidden = [one.effect for one in cases]
    assert hidden.count(None) == 20
    assert all(hidden.count(name) == 2 for name in NAMES)
    assert {one.rate for one in cases} == {100, 250, 1000}


@pytest.mark.slow
def test_a_simulated_axis_obeys_the_balance_of_its_energy() -> None:
    """Work of the force = kinetic energy + viscous and Coulomb losses, from the position alone."""
    axis = Axis(
        inertia=2.0,
        viscous=1.0,
        coulomb=3.0,
        width=0.01,
        offset=0.0,
        middle=0.0,
        travel=1.0,
        speed=1.0,
    )
    one = np.ones(1)
    drive = Drive(
        sizes=one,
        rates=2.0 * one,
        phases=0.3 * one,
        dither=0.0 * one,
        tones=one,
        turns=one,
        load=0.0,
        load_rate=1.0,
        count=1e-6,
    )
    _, position, force, _ = run(axis, drive, 3.0)
    speed = np.gradient(position, STEP)
    way = np.diff(position)
    work = float(np.sum(force[:-1] * way))
    lost = float(np.sum((speed**2 + 3.0 * speed * np.tanh(speed / 0.01)) * STEP))
    kinetic = speed[-1] ** 2 - speed[0] ** 2
    assert work == pytest.approx(kinetic + lost, rel=2e-3)


@pytest.mark.slow
def test_a_hidden_effect_is_named_and_unknown_without_it() -> None:
    hidden = axis_trial.case(10)
    assert hidden.effect == "quadratic_drag"
    runs = axis_trial.logs(hidden)
    assert axis_trial.is_right("quadratic_drag", axis_trial.diagnosed(runs))
    assert axis_trial.diagnosed(runs, ("quadratic_drag",)).verdict.kind == "unknown"


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1117, 1118])
def test_a_saturation_is_named_alone(seed: int) -> None:
    """Its force is that of the parameters beside it; with others a friction by the load remains."""
    hidden = axis_trial.case(seed)
    assert hidden.effect == "torque_constant"
    assert axis_trial.is_right("torque_constant", axis_trial.diagnosed(axis_trial.logs(hidden)))


@pytest.mark.slow
def test_a_resonance_is_found_with_its_damping() -> None:
    """The axis of seed 1115 has a spring of 110 rad/s and a damping ratio of 0.05."""
    (first, *_) = axis_trial.diagnosed(axis_trial.logs(axis_trial.case(1115))).ranking
    found = {one.name: one.value for one in first.parameters}
    assert found["elasticity_frequency"] == pytest.approx(110.0, rel=0.01)
    assert found["elasticity_damping"] == pytest.approx(0.05, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "effect"),
    [(9, "quadratic_drag"), (23, "elasticity"), (27, "delay"), (1096, "coulomb_asymmetry")],
)
def test_an_effect_that_the_library_lacks_is_unknown(seed: int, effect: str) -> None:
    """Neighbours that nearly do: a wide rise of friction, noise, a lag, an offset."""
    hidden = axis_trial.case(seed)
    assert hidden.effect == effect
    assert axis_trial.diagnosed(axis_trial.logs(hidden), (effect,)).verdict.kind == "unknown"
