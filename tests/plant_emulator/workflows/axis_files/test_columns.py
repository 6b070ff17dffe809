"""Which column is which quantity, and its values in SI units."""

import math

import numpy as np
import pytest

from plant_emulator.errors import LogError
from plant_emulator.workflows.axis_files.columns import (
    choices,
    quantity_of,
    unit_behind,
    unit_in,
)
from plant_emulator.workflows.axis_files.units import convert_unit, target


@pytest.mark.parametrize(
    ("word", "column", "factor", "unit"),
    [
        ("position=enc:deg", "enc", 1.0, "deg"),
        ("force=iq*0.40:Nm", "iq", 0.40, "Nm"),
        ("force=iq*0.040*20:Nm", "iq", 0.8, "Nm"),
        ("position=enc/28.17:deg", "enc", 1.0 / 28.17, "deg"),
        ("force=torque_Nm*-1", "torque_Nm", -1.0, None),
        ("velocity=Speed [rad/s]", "Speed [rad/s]", 1.0, None),
        ("time=data(:,1):ms", "data(:,1)", 1.0, "ms"),
        ("time=data(:,1)", "data(:,1)", 1.0, None),
        ("load=a:b:N", "a:b", 1.0, "N"),
    ],
)
def test_a_choice_has_column_factor_and_unit(
    word: str, column: str, factor: float, unit: str | None
) -> None:
    [found] = choices([word])
    assert (found.column, found.unit) == (column, unit)
    assert found.factor == pytest.approx(factor)
    name, _, rest = word.partition("=")
    assert choices({name: rest}) == (found,)


@pytest.mark.parametrize("word", ["enc:deg", "speed=n:rpm", "position=", "force=iq*0:Nm"])
def test_words_that_are_no_choice_are_refused(word: str) -> None:
    with pytest.raises(LogError, match=r"NAME=COLUMN|another one is needed"):
        choices([word])


def test_a_quantity_is_chosen_once() -> None:
    with pytest.raises(LogError, match="force is chosen twice"):
        choices(["torque=a:Nm", "force=b:Nm"])


@pytest.mark.parametrize(
    ("quantity", "unit", "own", "factor"),
    [
        ("position", "deg", "rad", math.pi / 180.0),
        ("position", "°", "rad", math.pi / 180.0),
        ("position", "rev", "rad", 2.0 * math.pi),
        ("position", "mm", "m", 1e-3),
        ("velocity", "rpm", "rad/s", math.pi / 30.0),
        ("velocity", "1/min", "rad/s", math.pi / 30.0),
        ("velocity", "U/min", "rad/s", math.pi / 30.0),
        ("velocity", "mm/s", "m/s", 1e-3),
        ("force", "Nm", "N m", 1.0),
        ("force", "mNm", "N m", 1e-3),
        ("force", "N·m", "N m", 1.0),
        ("force", "kN", "N", 1e3),
        ("load", "lbf*ft", "N m", 1.3558179483),
        ("time", "ms", "s", 1e-3),
        ("temperature", "°C", "degC", 1.0),
    ],
)
def test_units_convert_to_those_of_a_log(quantity: str, unit: str, own: str, factor: float) -> None:
    assert target(quantity, unit) == own
    assert convert_unit(np.array([2.0]), unit, own) == pytest.approx([2.0 * factor])


def test_kelvin_converts_to_degrees_celsius() -> None:
    assert convert_unit(np.array([300.0]), "K", "degC") == pytest.approx([26.85])


@pytest.mark.parametrize(
    ("quantity", "unit"),
    [("force", "A"), ("velocity", "Hz"), ("velocity", "1/s"), ("position", "%"), ("time", "m")],
)
def test_units_of_other_quantities_are_none(quantity: str, unit: str) -> None:
    assert target(quantity, unit) is None


def test_names_tell_quantity_and_unit() -> None:
    assert quantity_of("torque_Nm") == "force"
    assert quantity_of("Position [deg]") == "position"
    assert quantity_of("temp") is None
    assert unit_in("iq (mA)") == "mA"
    assert unit_behind("velocity_mm_s") == ("velocity", "mm/s")
    assert unit_behind("load_torque_mNm") == ("load", "mNm")
    assert unit_behind("position_error") is None
