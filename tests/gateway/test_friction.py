"""Friction law of the gateway, against numbers of the thesis and by hand."""

from dataclasses import replace
from math import exp
from pathlib import Path

import pytest

import plant_emulator
from gateway.config_file import load_friction
from gateway.errors import ConfigError
from gateway.friction import THESIS, friction_table, friction_torque, read_friction

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
    assert read_friction(WARMER.document, "here") == WARMER


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
        read_friction(table, "here")


def parameter_set(**changes):
    tables = {
        "gear_coulomb_friction": {"value": 39.5879, "unit": "N m"},
        "gear_viscous_friction": {"value": 379.918, "unit": "N m (s/rad)^delta_g"},
        "gear_friction_exponent": {"value": 0.4418, "unit": "1"},
        "drum_radius": {"value": 0.645, "unit": "m"},
    }
    return {name: table for name, table in (tables | changes).items() if table is not None}


def test_a_parameter_set_gives_its_three_friction_values():
    table = friction_table(parameter_set(), "set.toml")
    assert table == {"coulomb": 39.5879, "viscous": 379.918, "exponent": 0.4418}


def test_the_shipped_parameter_set_is_the_friction_that_the_gateway_starts_with():
    shipped = Path(plant_emulator.__file__).parent / "parameter_sets" / "thesis_table_3_1.toml"
    assert read_friction(load_friction(shipped), "here") == THESIS


def test_origin_of_a_measured_map_changes_nothing():
    document = {"coulomb": 40.0, "viscous": 300.0, "measured": {"date": "2026-11-21"}}
    assert friction_table(document, "map.toml") == {"coulomb": 40.0, "viscous": 300.0}


@pytest.mark.parametrize(
    ("document", "match"),
    [
        ({}, r"f\.toml: neither a friction map nor a parameter set, found 'nothing'.*coulomb"),
        ({"drum_radius": {"value": 1.0}}, r"neither.*drum_radius.*gear_viscous_friction"),
        (parameter_set(viscous=300.0), r"f\.toml: both a parameter set and a friction map"),
        (parameter_set(gear_friction_exponent=None), r"f\.toml: gear_friction_exponent: no value"),
        (parameter_set(gear_coulomb_friction=36.0), "gear_coulomb_friction: no value, found 36"),
        (
            parameter_set(gear_coulomb_friction={"value": 36.0, "unit": "lbf ft"}),
            r"gear_coulomb_friction\.unit: wrong unit, found 'lbf ft'; expected N m",
        ),
        (
            parameter_set(gear_viscous_friction={"value": -1.0, "unit": "N m (s/rad)^delta_g"}),
            r"f\.toml: gear_viscous_friction\.value: bad value, found -1\.0; expected 0 \.\.",
        ),
    ],
)
def test_a_friction_file_that_is_neither_or_broken_is_refused_by_name(document, match):
    with pytest.raises(ConfigError, match=match):
        friction_table(document, "f.toml")
