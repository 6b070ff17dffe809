"""Road load in newtons, against the numbers of the thesis and hand calculations."""

from dataclasses import replace
from math import atan, sin

import pytest

from gateway.configuration.config import Config
from gateway.physics.road_load import road_load

CONFIG = Config()
V = 14.0 / 3.6


def load_of(**values):
    return road_load(replace(CONFIG.truck, **values), CONFIG.bench)


def test_unloaded_truck_of_table_4_1_needs_419_newton_at_14_km_h():
    assert load_of().force(V) == pytest.approx(419.0, abs=2.0)


def test_loaded_truck_of_table_4_1_needs_588_newton_at_14_km_h():
    loaded = load_of(load=1600.0, crr=0.011447, crr_v=4.3296e-6)
    assert loaded.force(V) == pytest.approx(588.0, abs=2.0)


def test_f0_and_f1_of_the_same_truck_give_the_same_force():
    """By hand: F0 = m g Crr = 418.5 N, F1 = m g Crr_v / r_d = 0.52 N s/m."""
    assert load_of(f0=418.5, f1=0.52).force(V) == pytest.approx(load_of().force(V), abs=0.1)


def test_f2_counts_with_the_square_of_the_speed():
    load = load_of(f0=400.0, f1=10.0, f2=3.0)
    assert load.force(2.0) == 400.0 + 20.0 + 12.0


@pytest.mark.parametrize("values", [{}, {"f0": 400.0, "f1": 10.0, "f2": 3.0}])
def test_resistance_acts_against_the_motion_and_not_at_rest(values):
    load = load_of(**values)
    assert load.force(-2.0) == -load.force(2.0)
    assert load.force(0.0) == 0.0


def test_gravity_pulls_downhill_whichever_way_the_truck_goes():
    """The thesis has it under the sign of the speed (eq 4.11); 40 CFR 1066.210 has not."""
    flat, hill = load_of(), load_of(grade=0.05)
    pull = 3640.0 * 9.81 * sin(atan(0.05))
    for speed in (-2.0, 2.0):
        assert hill.force(speed) - flat.force(speed) == pytest.approx(pull, rel=1e-3)
    assert hill.force(0.0) == pytest.approx(pull)


def test_a_standing_truck_starts_uphill_with_grade_and_resistance():
    load = load_of(grade=0.05)
    assert load.breakaway == pytest.approx(load.force(1e-9), rel=1e-6)
