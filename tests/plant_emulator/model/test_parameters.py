"""Table 3.1, typed by hand, and what a parameter set may not hold."""

from math import pi
from pathlib import Path

import pytest

from plant_emulator import parameter_sets
from plant_emulator.errors import ParameterError
from plant_emulator.model.parameters import ParameterSet, torsional_stiffness

# Thesis, Table 3.1; units corrected where the table's do not fit its equations.
TABLE_3_1 = [
    ("armature_resistance", "R_a", 0.424, "ohm", "given"),
    ("armature_inductance", "L_a", 0.004, "H", "given"),
    ("motor_inertia", "J_m", 0.128, "kg m^2", "given"),
    ("flux_constant", "K_m", 1.8506, "N m/A", "given"),
    ("flux_constant_1", "K_1", 366.83, "(N m/A)(rad/s)", "estimated"),
    ("flux_constant_2", "K_2", 8.0644, "rad/s", "estimated"),
    ("gear_inertia", "J_g", 0.02242, "kg m^2", "estimated"),
    ("gear_ratio", "xi_g", 62.6, "1", "given"),
    ("shear_modulus", "G", 79.3e9, "Pa", "given"),
    ("motor_shaft_length", "l_mg", 0.6, "m", "given"),
    ("motor_shaft_radius", "r_mg", 0.025, "m", "given"),
    ("drum_shaft_length", "l_gd", 0.577, "m", "given"),
    ("drum_shaft_radius", "r_gd", 0.05, "m", "given"),
    ("gear_coulomb_friction", "f_gc", 35.989, "N m", "estimated"),
    ("gear_viscous_friction", "f_g", 345.38, "N m (s/rad)^delta_g", "estimated"),
    ("gear_friction_exponent", "delta_g", 0.4418, "1", "estimated"),
    ("drum_shaft_damping", "c", 1.2032e5, "N m s/rad", "estimated"),
    ("drum_inertia", "J_d", 312.69, "kg m^2", "estimated"),
    ("drum_radius", "r_d", 0.645, "m", "given"),
    ("backlash_half_gap", "alpha", 0.15073, "rad", "estimated"),
    ("speed_gain", "K_p,speed", 15.0, "A/(rad/s)", "given"),
    ("speed_integral_time", "T_i,speed", 1.0, "s", "given"),
    ("current_gain", "K_p,current", 30.0, "V/A", "given"),
    ("current_integral_time", "T_i,current", 3.0, "s", "given"),
    ("dead_time", "b", 0.063947, "s", "estimated"),
]
# Relative prior standard deviation of the estimated ones; gear_inertia is held fixed.
PRIORS = {
    "gear_coulomb_friction": 0.20,
    "drum_shaft_damping": 0.20,
    "flux_constant_2": 0.20,
    "gear_viscous_friction": 0.10,
    "drum_inertia": 0.10,
    "backlash_half_gap": 0.10,
    "dead_time": 0.10,
    "gear_friction_exponent": 0.05,
    "flux_constant_1": 0.05,
}


@pytest.mark.parametrize(("name", "symbol", "value", "unit", "kind"), TABLE_3_1)
def test_parameter_is_the_tables(
    nominal: ParameterSet, name: str, symbol: str, value: float, unit: str, kind: str
) -> None:
    found = nominal[name]
    assert (found.symbol, found.value, found.unit, found.kind) == (symbol, value, unit, kind)
    assert "Table 3.1" in found.source


@pytest.mark.parametrize(
    ("name", "table"), [("motor_shaft_stiffness", 8.1096e4), ("drum_shaft_stiffness", 1.3493e6)]
)
def test_calculated_stiffness_is_the_tables(nominal: ParameterSet, name: str, table: float) -> None:
    assert nominal[name].kind == "calculated"
    assert nominal.value(name) == pytest.approx(table, rel=5e-5)  # five printed digits
    assert nominal[name].unit == "N m/rad"


def test_limits_are_those_of_the_text(nominal: ParameterSet) -> None:
    assert nominal.value("voltage_limit") == 400.0
    assert nominal.value("armature_current_limit") == 72.0
    assert nominal.value("speed_limit") == pytest.approx(4830 * 2 * pi / 60, rel=1e-8)


def test_every_estimated_parameter_has_its_prior_and_gear_inertia_none(
    nominal: ParameterSet,
) -> None:
    priors = {p.name: p.std / p.value for p in nominal if p.std is not None}
    assert priors == pytest.approx(PRIORS)
    assert {p.name for p in nominal if p.kind == "estimated"} == {*PRIORS, "gear_inertia"}


def test_torsional_stiffness_of_a_unit_shaft_is_half_pi_of_its_modulus() -> None:
    assert torsional_stiffness(2.0, 1.0, 1.0) == pytest.approx(pi)
    assert torsional_stiffness(2.0, 2.0, 4.0) == pytest.approx(4 * pi)  # r^4 / l


def test_calculated_value_follows_a_changed_radius(nominal: ParameterSet) -> None:
    thicker = nominal.with_values({"motor_shaft_radius": 0.05})
    assert thicker.value("motor_shaft_stiffness") == pytest.approx(16 * 81096, rel=5e-5)
    assert thicker.value("drum_shaft_stiffness") == nominal.value("drum_shaft_stiffness")


def test_calculated_value_that_is_itself_changed_stays_as_given(nominal: ParameterSet) -> None:
    changed = nominal.with_values({"motor_shaft_radius": 0.05, "motor_shaft_stiffness": 9e4})
    assert changed.value("motor_shaft_stiffness") == 9e4


def test_changing_a_copy_leaves_the_set_alone(nominal: ParameterSet) -> None:
    nominal.with_values({"drum_inertia": 340.0})
    assert nominal.value("drum_inertia") == 312.69


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1.0, 0.0])
def test_impossible_inertia_is_refused(nominal: ParameterSet, value: float) -> None:
    with pytest.raises(ParameterError, match="drum_inertia"):
        nominal.with_values({"drum_inertia": value})


@pytest.mark.parametrize("name", ["dead_time", "backlash_half_gap", "gear_inertia"])
def test_a_term_may_be_left_out_by_zero(nominal: ParameterSet, name: str) -> None:
    assert nominal.with_values({name: 0.0}).value(name) == 0.0


def test_change_of_an_unknown_name_is_refused(nominal: ParameterSet) -> None:
    with pytest.raises(ParameterError, match="drum_inertai is no parameter"):
        nominal.with_values({"drum_inertai": 1.0})


def shipped_text() -> str:
    return (parameter_sets.FOLDER / "thesis_table_3_1.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('unit = "ohm"', 'unit = "mohm"', "armature_resistance.unit: 'mohm'; must be 'ohm'"),
        ("value = 0.424", 'value = "0.424"', "armature_resistance.value: '0.424'"),
        ("value = 0.424", "value = true", "armature_resistance.value: True"),
        ("value = 0.424", "value = nan", "armature_resistance: nan"),
        ("value = 0.424", "", "armature_resistance.value: None; a number is needed"),
        ('kind = "given"', 'kind = "guessed"', "armature_resistance.kind: 'guessed'; one of"),
        ('symbol = "R_a"', 'symbl = "R_a"', "armature_resistance.symbl: unknown key"),
        ('kind = "given"', 'kind = "calculated"', "armature_resistance.kind: there is no formula"),
        ("[armature_resistance]", "[resistance]", "resistance is no parameter"),
        ('kind = "calculated"', 'kind = "calculated"\nvalue = 8e4', "motor_shaft_stiffness.value"),
        ("std = 18.3415", 'std = "5 %"', "flux_constant_1.std"),
        ("[armature_resistance]", "[armature_resistance", "line"),
    ],
)
def test_faulty_set_is_refused_with_file_and_key(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    path = tmp_path / "my_bench.toml"
    path.write_text(shipped_text().replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ParameterError) as refusal:
        parameter_sets.load(str(path))
    assert str(path) in str(refusal.value)
    assert said in str(refusal.value)
    assert refusal.value.exit_code == 2


def test_missing_parameter_is_named(tmp_path: Path) -> None:
    path = tmp_path / "my_bench.toml"
    path.write_text(shipped_text().partition("[wheel_radius]")[0], encoding="utf-8")
    with pytest.raises(ParameterError, match="parameter wheel_radius is missing"):
        parameter_sets.load(str(path))


def test_entry_that_is_no_table_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "my_bench.toml"
    before, _, rest = shipped_text().partition("[drum_inertia]")
    after = rest[rest.index("[drum_radius]") :]
    path.write_text(f"drum_inertia = 312.69\n{before}{after}", encoding="utf-8")
    with pytest.raises(ParameterError, match="drum_inertia: a table with value, unit"):
        parameter_sets.load(str(path))


def test_unknown_set_names_the_shipped_ones() -> None:
    with pytest.raises(ParameterError, match=r"no such parameter set.*thesis_table_3_1"):
        parameter_sets.load("thesis_table_9")


def test_user_file_is_read_like_a_shipped_one(tmp_path: Path, nominal: ParameterSet) -> None:
    path = tmp_path / "my_bench.toml"
    path.write_text(shipped_text(), encoding="utf-8")
    assert parameter_sets.load(str(path)).values() == nominal.values()
