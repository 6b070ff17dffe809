"""What every regulator has to hold, whichever are found."""

from math import isfinite

import pytest

from gateway import regulators
from gateway.configuration.config import Config
from gateway.errors import ConfigError
from gateway.physics.window import Window

CONFIG = Config()


def window(*, torque=0.0, motor=100.0, drum=100.0 / 62.6, change=0.0, duration=0.01):
    return Window(
        duration=duration,
        shaft_torque=torque,
        motor_speed=motor,
        drum_speed=drum,
        drum_speed_change=change,
    )


@pytest.fixture(params=regulators.names())
def regulator(request):
    return regulators.load(request.param)


@pytest.fixture
def params(regulator):
    return regulator.Params.of(CONFIG)


def test_all_are_found_and_an_unknown_one_is_refused():
    assert set(regulators.names()) >= {"thesis", "compensated", "learned"}
    expected = r"regulator\.name.*'best'.*compensated or learned or thesis"
    with pytest.raises(ConfigError, match=expected):
        regulators.load("best")


def test_the_folder_is_not_looked_through_at_every_tick(monkeypatch):
    first = regulators.load("thesis")
    monkeypatch.setattr(regulators, "names", lambda: pytest.fail("looked through again"))
    assert regulators.load("thesis") is first


@pytest.mark.parametrize("motor", [50.0, 377.0])
def test_first_demand_after_seeding_is_the_measured_speed_but_for_one_window(
    regulator, params, motor
):
    state = regulator.seed(params, motor, motor / 62.6)
    _, demand = regulator.update(params, state, window(motor=motor, drum=motor / 62.6))
    fastest = 62.6 * 2000.0 / params.inertia
    assert demand.speed == pytest.approx(motor, abs=fastest * (0.01 + getattr(params, "lead", 0)))


def test_a_standing_bench_stays_standing(regulator, params):
    """A wound-up shaft, as it remains after a stop, is no truck that wants to go."""
    state = regulator.seed(params, 0.0, 0.0)
    for _ in range(1000):
        still = window(torque=-15.0, motor=0.0, drum=0.0)
        state, demand = regulator.update(params, state, still)
        assert (demand.speed, demand.rate) == (0.0, 0.0)


def test_demand_stays_inside_the_range_of_the_bench(regulator, params):
    for torque in (-300.0, 300.0):
        state = regulator.seed(params, 200.0, 200.0 / 62.6)
        for _ in range(400):
            state, demand = regulator.update(params, state, window(torque=torque))
            assert isfinite(demand.rate)
            assert 0.0 <= demand.speed <= params.speed_max


def test_a_pushing_truck_raises_the_demand_as_its_mass_says(regulator, params):
    """1000 N m more at the drum for 1 s speed up m r_d^2 = 1514.33 kg m^2 by 0.66036 rad/s more."""
    reached = []
    for torque in (0.0, 1000.0 / 62.6):
        state = regulator.seed(params, 200.0, 200.0 / 62.6)
        for _ in range(100):
            seen = window(torque=torque, motor=200.0, drum=200.0 / 62.6)
            state, demand = regulator.update(params, state, seen)
        reached.append(demand.speed / 62.6)
    faster = reached[1] - reached[0]
    gain = (1.0 + getattr(params, "lead", 0.0) + getattr(params, "trim", 0.0)) * 0.66036
    assert faster == pytest.approx(gain, rel=1e-4)


def test_the_bench_accelerating_itself_moves_no_truck(regulator, params):
    """Torque of the drum's own inertia over the window cancels the inertia term."""
    change = 0.01
    own = -312.71242 * change / 0.01 / 62.6
    state = regulator.seed(params, 200.0, 200.0 / 62.6)
    free, _ = regulator.update(params, state, window(motor=200.0, drum=200.0 / 62.6))
    moved, _ = regulator.update(
        params, state, window(torque=own, motor=200.0, drum=200.0 / 62.6, change=change)
    )
    virtual = {
        "virtual_speed": lambda one: one.virtual_speed,
        "integral": lambda one: one.integral + params.rho * change * (one is moved),
    }
    name = next(name for name in virtual if hasattr(state, name))
    assert virtual[name](moved) == pytest.approx(virtual[name](free), abs=1e-12)


def test_following_the_limits_makes_the_demand_what_they_passed(regulator, params):
    state = regulator.seed(params, 200.0, 200.0 / 62.6)
    free, demand = regulator.update(params, state, window(motor=200.0, drum=200.0 / 62.6))
    told = regulator.follow(params, free, demand.speed, demand.speed - 10.0)
    seen = window(motor=200.0, drum=200.0 / 62.6)
    _, after = regulator.update(params, told, seen)
    _, before = regulator.update(params, free, seen)
    assert before.speed - after.speed == pytest.approx(10.0, rel=1e-3)


def test_the_same_window_gives_the_same_answer(regulator, params):
    state = regulator.seed(params, 200.0, 200.0 / 62.6)
    seen = window(torque=-5.0, change=0.003)
    assert regulator.update(params, state, seen) == regulator.update(params, state, seen)
