"""Friction law of the gateway, against numbers of the thesis and by hand."""

from dataclasses import replace
from math import exp
from pathlib import Path

import pytest

import plant_emulator
from gateway.config_file import load, load_friction, with_values
from gateway.configuration.config import Config
from gateway.errors import ConfigError
from gateway.friction.document import read_friction, regulator_entries
from gateway.friction.law import (
    THESIS,
    Bearings,
    LoadLoss,
    OilTemperature,
    Stribeck,
    bearing_torque,
    friction_torque,
    idle_torque,
    load_loss,
    oil_temperature,
)
from gateway.review.review import review
from plant_emulator import parameter_sets
from register_maps import load as load_map

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
        ({"stribeck": 60.0}, r"here\.stribeck: no table.*rise, speed"),
        ({"stribeck": {"rice": 60.0}}, r"here\.stribeck\.rice: unknown key.*rise, speed"),
        ({"load_dependent_gear_loss": {"share": 0.9}}, r"share: bad value.*0 \.\. 0\.5"),
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
    entries = regulator_entries(parameter_set(), "set.toml")
    assert entries["friction"] == {"coulomb": 39.5879, "viscous": 379.918, "exponent": 0.4418}


def test_the_shipped_parameter_set_is_the_friction_that_the_gateway_starts_with():
    shipped = Path(plant_emulator.__file__).parent / "parameter_sets" / "thesis_table_3_1.toml"
    assert read_friction(load_friction(shipped)["friction"], "here") == THESIS


def test_origin_of_a_measured_map_changes_nothing():
    document = {"coulomb": 40.0, "viscous": 300.0, "measured": {"date": "2026-11-21"}}
    told = regulator_entries(document, "map.toml")
    assert told == {"friction": {"coulomb": 40.0, "viscous": 300.0}}


@pytest.mark.parametrize(
    ("document", "match"),
    [
        ({}, r"f\.toml: neither a friction map nor a parameter set, found 'nothing'.*coulomb"),
        ({"drum_radius": {"value": 1.0}}, r"neither.*drum_radius.*gear_viscous_friction"),
        (parameter_set(viscous=300.0), r"f\.toml: both a parameter set and a friction map"),
        (parameter_set(gear_friction_exponent=None), r"f\.toml: gear_friction_exponent: no value"),
        (parameter_set(gear_coulomb_friction=36.0), "gear_coulomb_friction: no value, found 36"),
        (parameter_set(effects={"stribeck": 60.0}), r"f\.toml: effects: no effects"),
        (
            parameter_set(effects={"torque_sensor_gain": {"error": "much"}}),
            r"f\.toml: effects\.torque_sensor_gain: bad value, found 'much'",
        ),
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
        regulator_entries(document, "f.toml")


# --- effects of a parameter set ---------------------------------------------------------------


def with_effects(**effects):
    return regulator_entries(parameter_set(effects=effects), "set.toml")


def test_effects_of_a_set_come_into_the_friction_table():
    share = {"share": 0.05, "difference": 0.1}
    entries = with_effects(load_dependent_gear_loss=share, stribeck={"rise": 60.0, "speed": 0.1})
    law = read_friction(entries["friction"], "here")
    assert law.load_dependent_gear_loss == LoadLoss(**share)
    assert law.breakaway == pytest.approx(39.5879 + 60.0)
    assert law.effects == ("load_dependent_gear_loss", "stribeck")
    assert read_friction(law.document, "here") == law


def test_oil_starts_as_far_from_the_shell_as_in_the_identified_runs():
    values = {
        "viscosity_coefficient": 0.02,
        "start_temperature": 258.15,
        "shell_temperature": 293.15,
    }
    law = read_friction(with_effects(gear_oil_temperature=values)["friction"], "here")
    assert oil_temperature(None, 0.0, 300.0, 0.01, law) == pytest.approx(265.0)


def test_errors_of_the_torque_sensor_become_its_corrections():
    entries = with_effects(
        torque_sensor_offset={"offset": 0.5},
        torque_sensor_gain={"error": 0.05},
        torque_sensor_lag={"time_constant": 0.04, "second_order": 0.1},
    )
    del entries["friction"]
    expected = {"torque_offset_Nm": 0.5, "torque_gain_percent": 5.0, "torque_lag_ms": 40.0}
    assert entries == pytest.approx(expected)


def test_friction_of_the_forward_direction_is_taken_of_an_asymmetry():
    table = with_effects(friction_asymmetry={"asymmetry": 0.1})["friction"]
    assert (table["coulomb"], table["exponent"]) == (pytest.approx(1.1 * 39.5879), 0.4418)


def test_an_effect_that_the_regulator_cannot_use_is_told():
    told = with_effects(drum_speed_lag={"time_constant": 0.1}, voltage_sag={})["friction"]
    assert read_friction(told, "here").left_out == ("drum_speed_lag", "voltage_sag")


def set_file(folder, **effects):
    """A whole parameter set as `diagnose --save` writes it."""
    path = folder / "set.toml"
    parameter_sets.save(replace(parameter_sets.load(), effects=effects), path)
    return path


def test_a_key_that_the_user_writes_wins_over_the_set(tmp_path):
    path = set_file(tmp_path, torque_sensor_offset={"offset": 0.5})
    told = with_values(Config(), {"regulator.friction": str(path)})
    kept = with_values(Config(), {"regulator.friction": str(path), "regulator.torque_offset_Nm": 1})
    assert (told.regulator.torque_offset, kept.regulator.torque_offset) == (0.5, 1.0)
    file = tmp_path / "bench.toml"
    file.write_text('[regulator]\nfriction = "set.toml"\ntorque_offset_Nm = 2.0\n')
    assert load(file).regulator.torque_offset == 2.0


def test_an_effect_out_of_range_is_refused_by_the_name_of_its_file(tmp_path):
    path = set_file(tmp_path, load_dependent_gear_loss={"share": 3.0})
    with pytest.raises(ConfigError, match=r"set\.toml: friction\.load_.*\.share: .* 0 \.\. 0\.5"):
        with_values(Config(), {"regulator.friction": str(path)})


def test_what_cannot_be_used_is_a_warning_of_the_review(tmp_path):
    path = set_file(tmp_path, drum_speed_lag={"time_constant": 0.1}, stribeck={"rise": 60.0})
    values = {"regulator.friction": str(path), "regulator.name": "thesis"}
    found = review(with_values(Config(), values), load_map("bench_int16")).findings
    warned = {(one.where, one.value) for one in found if one.severity == "warning"}
    assert {("regulator.friction", "drum_speed_lag"), ("regulator.name", "thesis")} <= warned


# --- laws of the effects, by hand -------------------------------------------------------------


def test_friction_rises_towards_standstill():
    law = replace(THESIS, stribeck=Stribeck(rise=60.0, speed=0.1))
    rise = friction_torque(0.1, law) - friction_torque(0.1, THESIS)
    assert rise == pytest.approx(60.0 * exp(-1.0))


@pytest.mark.parametrize(
    ("torque", "omega", "loss"),
    # T_gd = 1000: driving takes 0.05 x 1.2 = 0.06 of it, driven 0.05 x 0.8 = 0.04.
    [(1060.0, 2.0, 60.0), (-960.0, 2.0, 40.0), (-1060.0, -2.0, -60.0), (1060.0, 0.0, 0.0)],
)
def test_load_loss_acts_against_the_motion_by_the_transmitted_torque(torque, omega, loss):
    law = replace(THESIS, load_dependent_gear_loss=LoadLoss(share=0.05, difference=0.2))
    assert load_loss(torque, omega, law) == pytest.approx(loss)


def test_bearings_are_proportional_below_their_film_speed():
    law = replace(THESIS, drum_bearing_friction=Bearings(coulomb=20.0, viscous=5.0))
    assert bearing_torque(2.0, law) == pytest.approx(30.0)
    assert bearing_torque(-0.01, law) == pytest.approx(-10.05)


def test_the_idle_bench_takes_gear_and_loaded_bearings():
    law = replace(
        THESIS,
        drum_bearing_friction=Bearings(coulomb=20.0, viscous=5.0),
        load_dependent_gear_loss=LoadLoss(share=0.05),
    )
    assert idle_torque(2.0, law) - friction_torque(2.0, law) == pytest.approx(30.0 * 1.05)


OILY = replace(THESIS, gear_oil_temperature=OilTemperature(viscosity_coefficient=0.02))


def test_viscous_friction_follows_the_oil():
    cold = friction_torque(1.0, OILY, oil=293.15)
    assert cold == pytest.approx(35.989 + 345.38 * exp(0.4))
    assert friction_torque(1.0, OILY) == friction_torque(1.0, THESIS)


def test_oil_begins_at_the_shell_and_warms_by_its_losses():
    """Implicit over 100 s: (C + G t) dT = T_f omega t, as the shell is as warm as the oil was."""
    start = oil_temperature(None, 1.0, 293.15, 100.0, OILY)
    heat = friction_torque(1.0, OILY, oil=293.15)
    later = oil_temperature(start, 1.0, 293.15, 100.0, OILY)
    assert start == 293.15
    assert later - start == pytest.approx(heat * 100.0 / (1e5 + 100.0 * 100.0))


def test_oil_is_unknown_without_a_shell():
    assert oil_temperature(None, 1.0, None, 0.01, OILY) is None
    assert oil_temperature(300.0, 1.0, None, 0.01, OILY) == 300.0
