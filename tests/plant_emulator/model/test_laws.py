"""Constitutive laws against the thesis's numbers."""

from collections.abc import Callable
from types import SimpleNamespace

import pytest

from plant_emulator.model import drive, implicit_stage, laws
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.stage import STAGE

RPM = 2 * 3.141592653589793 / 60


@pytest.fixture
def p(nominal: ParameterSet) -> SimpleNamespace:
    return SimpleNamespace(**nominal.values())


def flux_at(motor_speed: float, p: SimpleNamespace) -> float:
    return laws.flux(SimpleNamespace(motor_speed=motor_speed), p)


def gear_friction(gear_speed: float, p: SimpleNamespace) -> float:
    """Eq. 3.27 from its two laws [N m]."""
    s = SimpleNamespace()
    viscous = laws.gear_viscous_friction(s, p) * gear_speed**p.gear_friction_exponent
    return laws.gear_coulomb_friction(s, p) + viscous


def test_field_weakens_above_1816_rpm(p: SimpleNamespace) -> None:
    base_speed = 190.16  # K_1 / K_m - K_2 [rad/s] = 1815.9 rpm
    assert base_speed == pytest.approx(1815.9 * RPM, rel=1e-4)
    assert flux_at(base_speed - 0.01, p) == p.flux_constant
    assert flux_at(base_speed + 0.01, p) < p.flux_constant


def test_flux_at_380_rad_per_second_is_0_945(p: SimpleNamespace) -> None:
    assert flux_at(380.0, p) == pytest.approx(366.83 / 388.0644)


def test_flux_is_the_same_in_both_directions(p: SimpleNamespace) -> None:
    assert flux_at(-380.0, p) == flux_at(380.0, p)
    assert flux_at(-100.0, p) == p.flux_constant


@pytest.mark.parametrize("speed", [-400.0, -250.0, 250.0, 400.0])
def test_flux_slope_is_the_difference_quotient(p: SimpleNamespace, speed: float) -> None:
    s = SimpleNamespace(motor_speed=speed)
    quotient = (flux_at(speed + 1e-4, p) - flux_at(speed - 1e-4, p)) / 2e-4
    assert drive.flux_slope(flux_at(speed, p), s, p) == pytest.approx(quotient, rel=1e-6)


def test_flux_has_no_slope_below_base_speed(p: SimpleNamespace) -> None:
    assert drive.flux_slope(p.flux_constant, SimpleNamespace(motor_speed=100.0), p) == 0.0
    assert drive.flux_slope(0.9 * p.flux_constant, SimpleNamespace(motor_speed=100.0), p) == 0.0


def test_friction_at_one_rad_per_second_is_the_sum_of_the_tables_values(
    p: SimpleNamespace,
) -> None:
    assert gear_friction(1.0, p) == pytest.approx(35.989 + 345.38)


def test_friction_at_14_km_per_hour_is_800_newton_metres(p: SimpleNamespace) -> None:
    friction = gear_friction(14 / 3.6 / 0.645, p)
    assert friction == pytest.approx(800.0, rel=5e-3)
    assert friction / p.gear_ratio == pytest.approx(12.8, abs=0.05)


def test_wheel_torque_acts_on_the_drum_by_the_ratio_of_the_radii(p: SimpleNamespace) -> None:
    assert laws.drum_torque(SimpleNamespace(wheel_torque=171.5), p) == pytest.approx(645.0)


def test_sensor_shows_the_driving_torque_as_negative(p: SimpleNamespace) -> None:
    assert laws.measured_shaft_torque(SimpleNamespace(motor_shaft_torque=13.4), p) == -13.4


NEGLECTED = [
    laws.converter_voltage_drop,
    laws.motor_coulomb_friction,
    laws.motor_viscous_friction,
    laws.motor_shaft_damping,
    laws.gear_torque,
    laws.drum_coulomb_friction,
    laws.drum_viscous_friction,
    laws.integration_at_limit,
]


@pytest.mark.parametrize("law", NEGLECTED, ids=lambda law: law.__name__)
def test_what_the_thesis_neglects_is_zero(law: object, p: SimpleNamespace) -> None:
    assert callable(law)
    assert law(SimpleNamespace(motor_speed=1.0, gear_speed=1.0, drum_speed=1.0), p) == 0.0


# Laws that act outside of the stage: on the reference before it, and on the log after it.
OUTSIDE = {"dead_time", "shell_temperature"}
OUTSIDE |= {f.__name__ for f in laws.LAWS if f.__name__.startswith("measured")}


@pytest.fixture
def s() -> SimpleNamespace:
    """A stage on the move, its laws evaluated by the test."""
    stage = SimpleNamespace(**dict.fromkeys(STAGE, 0.0))
    vars(stage).update(motor_speed=250.0, gear_speed=4.0, drum_speed=4.0, armature_current=10.0)
    vars(stage).update(gear_direction=1.0, delayed_reference=250.0, wheel_torque=10.0)
    return stage


@pytest.mark.parametrize("name", [law.__name__ for law in laws.LAWS if law.__name__ in STAGE])
def test_stage_holds_each_law_as_evaluated(
    name: str, s: SimpleNamespace, p: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(implicit_stage, name, lambda s, p: 0.125)
    implicit_stage.evaluate_laws(s, p)
    assert getattr(s, name) == 0.125


@pytest.mark.parametrize("law", [f for f in laws.LAWS if f.__name__ not in OUTSIDE])
def test_stage_is_solved_anew_whichever_law_has_moved(
    law: Callable[..., float],
    s: SimpleNamespace,
    p: SimpleNamespace,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    implicit_stage.evaluate_laws(s, p)
    assert not implicit_stage.laws_have_moved(0.0, s, p)
    monkeypatch.setattr(implicit_stage, law.__name__, lambda s, p: law(s, p) + 0.125)
    assert implicit_stage.laws_have_moved(0.0, s, p)


def test_every_law_is_listed_once_and_has_unit_or_dimension_in_its_docstring() -> None:
    assert len(set(laws.LAWS)) == len(laws.LAWS)
    for law in laws.LAWS:
        assert "[" in (law.__doc__ or ""), law.__name__
