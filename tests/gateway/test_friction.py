"""Friction law of the gateway, against numbers of the thesis and by hand."""

from dataclasses import replace
from math import exp

import pytest

from gateway.errors import ConfigError
from gateway.friction import THESIS, friction_torque, from_friction

WARMER = replace(THESIS, temperature_coefficient=0.01)


def test_at_one_rad_per_second_it_is_the_sum_of_the_tables_values():
    assert friction_torque(1.0, THESIS) == pytest.approx(35.989 + 345.38)


def test_at_14_km_h_it_is_800_newton_metres():
    assert friction_torque(14.0 / 3.6 / 0.645, THESIS) == pytest.approx(800.0, abs=3.0)


def test_it_is_odd_and_vanishes_at_rest():
    assert friction_torque(-2.0, THESIS) == -friction_torque(2.0, THESIS)
    assert friction_torque(0.0, THESIS) == 0.0


def test_it_falls_as_the_shell_warms():
    warm, cold = (friction_torque(2.0, WARMER, 273.15 + celsius) for celsius in (42.0, 22.0))
    nominal = friction_torque(2.0, THESIS)
    assert warm == pytest.approx(nominal * exp(-0.1))
    assert cold == pytest.approx(nominal * exp(0.1))


@pytest.mark.parametrize("temperature", [None, 305.15])
def test_without_or_at_the_reference_temperature_it_is_nominal(temperature):
    assert friction_torque(2.0, WARMER, temperature) == friction_torque(2.0, THESIS)


def test_without_a_coefficient_temperature_changes_nothing():
    assert friction_torque(2.0, THESIS, 280.0) == friction_torque(2.0, THESIS)


def test_a_document_makes_the_same_friction_again():
    assert from_friction(WARMER.document, "here") == WARMER


@pytest.mark.parametrize(
    ("table", "match"),
    [
        ("friction", "no friction table"),
        ({"colomb": 1.0}, r"here\.colomb: unknown key"),
        ({"coulomb": -1.0}, r"here\.coulomb: bad value.*-1\.0.*0 \.\. 10000"),
        ({"coulomb": "36"}, "bad value"),
        ({"exponent": True}, "bad value"),
        ({"exponent": float("nan")}, "bad value"),
    ],
)
def test_a_bad_table_is_refused_with_its_place(table, match):
    with pytest.raises(ConfigError, match=match):
        from_friction(table, "here")
