"""Friction of the gear that depends on direction, speed and load: exact, and settled at rest."""

from collections.abc import Callable, Mapping
from math import exp
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant_emulator.model import gear as gear_equation
from plant_emulator.model import implicit_stage
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.stage import STAGE, STATES
from plant_emulator.simulation.running_bench import Bench
from plant_emulator.solver.kernel import Kernel
from tests import reference_plant as thesis
from tests.plant_emulator.model.test_plant import TABLE, energy, size
from tests.plant_emulator.runs import GEAR, Piecewise, linear, simulate

ASYMMETRY = {"friction_asymmetry_asymmetry": 0.2}
STRIBECK = {"stribeck_rise": 60.0, "stribeck_speed": 0.1}


def table(omega: float) -> float:
    """Friction of the table at a speed of the gear output [N m]."""
    return 35.989 + 345.38 * abs(omega) ** 0.4418


# --- steady speed -------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [5.0, 120.0, 400.0, -5.0, -120.0])
@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        (ASYMMETRY, lambda w: (1.0 + 0.2 * np.sign(w)) * table(w)),
        (STRIBECK, lambda w: table(w) + 60.0 * exp(-((w / 0.1) ** 2))),
        (
            ASYMMETRY | STRIBECK,
            lambda w: (1.0 + 0.2 * np.sign(w)) * table(w) + 60.0 * exp(-((w / 0.1) ** 2)),
        ),
    ],
)
def test_steady_speed_needs_the_torque_of_the_law(
    nominal: ParameterSet, effect: Mapping[str, float], speed: float,
    expected: Callable[[float], float],
) -> None:  # fmt: skip
    log = simulate(
        linear((0.5, 0.0), (4.5, speed), duration=60.0, period=0.1), {**nominal.values(), **effect}
    )
    omega = speed / 62.6
    torque = -62.6 * float(np.mean(log["shaft_torque"][-50:]))
    assert torque == pytest.approx(np.sign(speed) * expected(omega), rel=2e-4)


# --- rest ---------------------------------------------------------------------------------------


def breakaway(nominal: ParameterSet, effect: Mapping[str, float], direction: float) -> float:
    """Torque of the shaft, over the gear, at which a slowly driven gear starts to turn [N m]."""
    bench = Piecewise({**nominal.values(), **effect})
    last = 0.0
    for k in range(1, 6000):
        channels = bench.to(1e-3 * k, direction * 2e-5 * k)
        if bench.x[GEAR] != 0.0:
            assert np.sign(bench.x[GEAR]) == direction
            return last
        last = 62.6 * abs(float(channels[-1, 3]))
    raise AssertionError("the gear did not move")


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_gear_breaks_away_at_the_level_of_its_direction(
    nominal: ParameterSet, direction: float
) -> None:
    expected = (1.0 + 0.2 * direction) * 35.989
    assert breakaway(nominal, ASYMMETRY, direction) == pytest.approx(expected, rel=0.02)
    assert breakaway(nominal, STRIBECK, direction) == pytest.approx(35.989 + 60.0, rel=0.02)


@pytest.mark.parametrize("effect", [ASYMMETRY, STRIBECK, ASYMMETRY | STRIBECK])
def test_gear_that_comes_to_rest_stays_there(
    nominal: ParameterSet, effect: Mapping[str, float]
) -> None:
    """Every stage settles, else the simulation is refused."""
    for sign in (1.0, -1.0):
        corners = ((0.1, 0.0), (0.6, sign * 40.0), (1.1, 0.0))
        bench = Piecewise({**nominal.values(), **effect})
        for time, reference in (*corners, (8.0, 0.0)):
            bench.to(time, reference)
        assert bench.x[GEAR] == 0.0
        simulate(linear(*corners, duration=5.0), {**nominal.values(), **effect})


@pytest.mark.parametrize("effect", [ASYMMETRY, STRIBECK, ASYMMETRY | STRIBECK])
def test_running_bench_settles_through_a_reversal(
    nominal: ParameterSet, effect: Mapping[str, float]
) -> None:
    own = {"friction_asymmetry": {}, "stribeck": {}}
    for key, value in effect.items():
        name = "stribeck" if key.startswith("stribeck") else "friction_asymmetry"
        own[name][key.removeprefix(f"{name}_")] = value
    bench = Bench(nominal, own)
    bench.advance([20.0 * np.sin(2e-3 * k) for k in range(6000)])
    assert bench.unsettled == 0


# --- symmetry and energy ------------------------------------------------------------------------

CORNERS = ((0.1, 0.0), (1.0, 150.0), (1.5, 150.0), (2.5, -120.0), (3.5, 0.0))


@pytest.mark.parametrize(
    ("effect", "mirrored"),
    [(STRIBECK, STRIBECK), (ASYMMETRY, {"friction_asymmetry_asymmetry": -0.2})],
)
def test_mirrored_reference_gives_mirrored_run(
    nominal: ParameterSet, effect: Mapping[str, float], mirrored: Mapping[str, float]
) -> None:
    """With the asymmetry turned round as well."""
    run = simulate(linear(*CORNERS, duration=5.0), {**nominal.values(), **effect})
    mirror = linear(*((t, -w) for t, w in CORNERS), duration=5.0)
    other = simulate(mirror, {**nominal.values(), **mirrored})
    for name in ("motor_speed", "drum_speed", "armature_current", "shaft_torque"):
        np.testing.assert_array_equal(run[name], -other[name])


def test_asymmetry_of_a_forward_run_is_a_friction_that_is_higher(nominal: ParameterSet) -> None:
    values = nominal.values()
    higher = {key: 1.2 * values[key] for key in ("gear_coulomb_friction", "gear_viscous_friction")}
    forward = linear((0.1, 0.0), (1.0, 150.0), (3.0, 150.0), duration=3.0)
    one = simulate(forward, {**values, **ASYMMETRY})
    other = simulate(forward, {**values, **higher})
    for name in ("motor_speed", "shaft_torque"):
        np.testing.assert_allclose(one[name], other[name], rtol=1e-6, atol=1e-6)


@settings(max_examples=20, deadline=None)
@given(
    speeds=st.tuples(*[st.floats(-2.0, 2.0)] * 2),
    gap=st.floats(-0.155, 0.155),
    effect=st.sampled_from([ASYMMETRY, STRIBECK, ASYMMETRY | STRIBECK]),
)
def test_free_bench_only_loses_energy(
    nominal: ParameterSet, speeds: tuple[float, float], gap: float, effect: Mapping[str, float]
) -> None:
    bench = Piecewise({**nominal.values(), **effect, "voltage_limit": 1e-12})
    bench.x[:8] = [0.0, 0.0, 0.0, 62.6 * speeds[0], 0.0, speeds[0], gap, speeds[1]]
    before = first = energy(bench.x)
    for k in range(1, 61):
        bench.to(0.01 * k, 0.0)
        now = energy(bench.x)
        assert now <= before + 1e-12 * (first + 1.0)
        before = now


# --- one stage with direction, Stribeck and load at once ----------------------------------------


@settings(max_examples=400, deadline=None)
@given(
    a=st.sampled_from([1e-6, 1e-5, 1e-4, 3e-4, 3e-3]),
    gear=st.one_of(st.just(0.0), size(1e-7, 5.0)),
    estimate=size(1e-7, 1.0),
    slip=size(1e-5, 0.1),
    twist=size(1e-8, 3e-5),
    gap=st.floats(-0.16, 0.16),
    drum=size(1e-6, 1.0),
    asymmetry=st.sampled_from([-0.5, 0.0, 0.3]),
    rise=st.sampled_from([0.0, 80.0]),
    load=st.sampled_from([0.0, 0.05]),
)
def test_stage_balances_friction_by_direction_speed_and_load(
    a: float, gear: float, estimate: float, slip: float, twist: float, gap: float, drum: float,
    asymmetry: float, rise: float, load: float,
) -> None:  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        for module in (implicit_stage, gear_equation):
            patch.setattr(
                module, "gear_direction_factor", lambda s, p: 1.0 + asymmetry * s.gear_direction
            )
            patch.setattr(
                module, "gear_speed_friction", lambda s, p: rise * exp(-((s.gear_speed / 0.1) ** 2))
            )
            patch.setattr(
                module, "gear_load_friction", lambda s, p: load * abs(s.drum_shaft_torque)
            )
        motor = 62.6 * gear + slip
        base = [0.0, 0.1 * motor, 0.0, motor, twist, gear, gap, gear + drum]
        s = SimpleNamespace(**dict.fromkeys(STAGE, 0.0))
        vars(s).update(zip(STATES, base, strict=True))
        s.gear_speed = gear + estimate
        s.delayed_reference = motor
        implicit_stage.solve_stage(base, a, s, TABLE)
    assert s.unsettled == 0.0
    omega, closing = s.gear_speed, s.gear_speed - s.drum_speed
    T_mg = thesis.k_mg * (twist + a * (s.motor_speed - 62.6 * omega))
    T_gd = thesis.k_gd * thesis.dead_zone(gap + a * closing + thesis.c / thesis.k_gd * closing)
    driving = 62.6 * T_mg - T_gd - thesis.J_g * (omega - gear) / a
    direction = np.sign(omega) or np.sign(driving)
    level = (1.0 + asymmetry * direction) * table(omega) + load * abs(T_gd)
    level += rise * exp(-((omega / 0.1) ** 2))
    if omega == 0.0:
        assert abs(driving) <= level + 1e-2
    else:
        assert driving == pytest.approx(direction * level, abs=2e-2, rel=1e-6)


# --- effects to come ----------------------------------------------------------------------------


def test_load_and_presliding_laws_settle(
    nominal: ParameterSet, model_with: Callable[[str], Kernel]
) -> None:
    """A loss by load, and a friction that is a spring over a small displacement (Dahl)."""
    by_load = model_with(
        "def gear_load_friction(value, s, p):\n"
        "    return value + p.own_size * abs(s.drum_shaft_torque)"
    )
    sliding = model_with(
        "def start(p):\n    return 0.0\n\n\n"
        "def advance(base, a, s, p):\n"
        "    return (base + a * s.gear_speed) / (1.0 + a * abs(s.gear_speed) / p.own_size)\n\n\n"
        "MEMORIES = {'bend': Memory(start, advance)}\n\n\n"
        "def gear_coulomb_friction(value, s, p):\n    return 0.0\n\n\n"
        "def gear_torque(value, s, p):\n"
        "    return value + p.gear_coulomb_friction / p.own_size * s.own_bend"
    )
    for model, own in ((by_load, 0.05), (sliding, 1e-3)):
        bench = Bench(nominal, {"own": {"size": own}}, kernel=model)
        bench.advance([30.0 * np.sin(4e-3 * k) for k in range(3000)])
        assert bench.unsettled == 0
