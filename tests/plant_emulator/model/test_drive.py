"""The drive alone, one implicit stage at a time."""

from types import SimpleNamespace

import pytest

from plant_emulator.model import drive, implicit_stage, laws
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.stage import STAGE

A = 1e-4  # implicit step [s]


@pytest.fixture
def p(nominal: ParameterSet) -> SimpleNamespace:
    return SimpleNamespace(**nominal.values())


def stage(p: SimpleNamespace, reference: float, motor_speed: float) -> SimpleNamespace:
    """A stage with its laws evaluated."""
    s = SimpleNamespace(**dict.fromkeys(STAGE, 0.0))
    s.delayed_reference, s.motor_speed = reference, motor_speed
    implicit_stage.evaluate_laws(s, p)
    return s


def state(*, integral: float = 0.0, current_integral: float = 0.0, current: float = 0.0) -> list:
    return [integral, current_integral, current]


def test_current_reference_is_gain_times_error_plus_integral(p: SimpleNamespace) -> None:
    s = stage(p, reference=101.0, motor_speed=100.0)
    drive.solve_speed_loop(state(integral=2.0), 0.0, s, p)
    assert s.current_reference == pytest.approx(15.0 * 1.0 + 15.0 / 1.0 * 2.0)


def test_drop_of_the_converter_is_linear_about_the_current(
    p: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By hand: 6 i / (|i| + 2) is 3 at 2 A, of slope 6 * 2 / (2 + 2)^2 = 0.75."""
    monkeypatch.setattr(
        drive,
        "converter_voltage_drop",
        lambda s, _p: 6.0 * s.armature_current / (abs(s.armature_current) + 2.0),
    )
    s = stage(p, reference=0.0, motor_speed=0.0)
    assert (s.converter_drop_offset, s.converter_drop_slope) == (0.0, 0.0)
    s.armature_current = 2.0
    drive.linearise_drop(s, p)
    assert s.armature_current == 2.0
    assert s.converter_drop_slope == pytest.approx(0.75, rel=1e-4)
    assert s.converter_drop_offset == pytest.approx(3.0 - 0.75 * 2.0, rel=1e-4)


def test_integral_grows_by_the_error(p: SimpleNamespace) -> None:
    s = stage(p, reference=101.0, motor_speed=100.0)
    drive.solve_speed_loop(state(integral=2.0), A, s, p)
    assert s.speed_integral == pytest.approx(2.0 + A * 1.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_current_reference_is_held_to_72_ampere(p: SimpleNamespace, sign: float) -> None:
    s = stage(p, reference=sign * 100.0, motor_speed=0.0)
    drive.solve_speed_loop(state(), A, s, p)
    assert s.current_reference == sign * 72.0


def test_limited_integrator_does_not_grow(p: SimpleNamespace) -> None:
    s = stage(p, reference=100.0, motor_speed=0.0)
    drive.solve_speed_loop(state(integral=3.0), A, s, p)
    assert s.speed_integral == 3.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_integrator_slides_along_the_limit(p: SimpleNamespace, sign: float) -> None:
    """By hand: at an error of 1 rad/s, 15 + 15 I is 72 A at I = 3.8 rad.

    Held at 3.799 it would leave the limit, and taking in 0.01 s of the error it would exceed it.
    """
    s = stage(p, reference=sign * 101.0, motor_speed=sign * 100.0)
    drive.solve_speed_loop(state(integral=sign * 3.799), 0.01, s, p)
    assert s.current_reference == sign * 72.0
    assert s.speed_integral == pytest.approx(sign * 3.8, rel=1e-12)
    other = stage(p, reference=sign * 101.0, motor_speed=sign * 100.0 + 1e-4)
    drive.solve_speed_loop(state(integral=sign * 3.799), 0.01, other, p)
    slope = (other.speed_integral - s.speed_integral) / 1e-4
    assert s.speed_integral_slope == pytest.approx(slope, rel=1e-6)
    assert drive.keeps_limits(0.0, s)
    assert not drive.keeps_limits(sign * -0.01, s), "the integrator would be held"


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("a", "share", "taken"), [(0.0, 0.0, 0.0), (A, 1.0, 100.0 * A)])
def test_integrator_with_nothing_to_hold_takes_in_its_error(
    p: SimpleNamespace, sign: float, a: float, share: float, taken: float
) -> None:
    """A stage of no length, and an integrator without anti-windup, far beyond the limit."""
    s = stage(p, reference=sign * 100.0, motor_speed=0.0)
    s.integration_at_limit = share
    drive.solve_drive(state(integral=sign * 3.0, current_integral=sign * 1.5), a, s, p)
    assert s.current_reference == sign * 72.0
    assert s.speed_integral == pytest.approx(sign * (3.0 + taken))
    error = s.current_reference - s.armature_current
    assert s.current_integral == pytest.approx(sign * 1.5 + a * share * error)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_voltage_integrator_slides_along_the_limit(p: SimpleNamespace, sign: float) -> None:
    """At 400 V the current is known; of 10 ms of its error the integrator takes in one half.

    30 e + 10 I is then 400 V at the end of the stage, 5 a e less with I held, and more with all.
    """
    s = stage(p, reference=sign * 260.0, motor_speed=sign * 250.0)
    a, start = 0.01, sign * 20.0
    b = a / 0.004
    current = (start + b * (sign * 400.0 - s.flux * s.motor_speed)) / (1.0 + b * 0.424)
    error = sign * 72.0 - current
    base = state(current_integral=sign * 40.0 - 3.0 * error - 0.5 * a * error, current=start)
    drive.solve_drive(base, a, s, p)
    assert s.armature_voltage == sign * 400.0
    assert s.armature_current == pytest.approx(current)
    assert s.current_integral == pytest.approx(base[1] + 0.5 * a * error, rel=1e-12)
    other = stage(p, reference=sign * 260.0, motor_speed=sign * 250.0 + 1e-4)
    other.flux = laws.flux(other, p)
    drive.solve_drive(base, a, other, p)
    slope = (other.current_integral - s.current_integral) / 1e-4
    assert s.current_integral_slope == pytest.approx(slope, rel=1e-4)


def test_limited_integrator_takes_in_what_leads_back(p: SimpleNamespace) -> None:
    s = stage(p, reference=99.0, motor_speed=100.0)
    drive.solve_speed_loop(state(integral=20.0), A, s, p)  # wants 15 * 20 - 15 = 285 A
    assert s.current_reference == 72.0
    assert s.speed_integral == pytest.approx(20.0 - A * 1.0)


def test_current_leaves_its_limit_at_once_when_the_error_changes_sign(p: SimpleNamespace) -> None:
    just_limited = 72.0 / 15.0
    s = stage(p, reference=99.9, motor_speed=100.0)
    drive.solve_speed_loop(state(integral=just_limited), A, s, p)
    assert s.current_reference == pytest.approx(72.0 - 15.0 * 0.1, rel=1e-3)


def test_reference_is_held_to_4830_rpm(p: SimpleNamespace) -> None:
    s = stage(p, reference=600.0, motor_speed=505.0)
    drive.solve_speed_loop(state(), 0.0, s, p)
    assert s.current_reference == pytest.approx(15.0 * (505.796417 - 505.0))


def test_armature_solves_its_own_equation(p: SimpleNamespace) -> None:
    """L_a di/dt = u - R_a i - k Phi omega with u = 30 (i_ref - i) + 30/3 (integral at the end)."""
    s = stage(p, reference=100.5, motor_speed=100.0)
    base = state(integral=0.1, current_integral=18.0, current=8.0)
    drive.solve_drive(base, A, s, p)
    assert abs(s.armature_voltage) < 400.0
    rate = (s.armature_current - 8.0) / A
    assert 0.004 * rate == pytest.approx(
        s.armature_voltage - 0.424 * s.armature_current - 1.8506 * 100.0, rel=1e-9
    )
    error = s.current_reference - s.armature_current
    assert s.armature_voltage == pytest.approx(30.0 * error + 10.0 * s.current_integral)
    assert s.current_integral == pytest.approx(18.0 + A * error)


def test_voltage_is_held_to_400_volt_and_its_integrator_waits(p: SimpleNamespace) -> None:
    s = stage(p, reference=100.0, motor_speed=0.0)
    drive.solve_drive(state(current_integral=0.5), A, s, p)  # asks for 72 A at once: 2160 V
    assert s.armature_voltage == 400.0
    assert s.current_integral == 0.5
    assert 0.004 * s.armature_current / A == pytest.approx(400.0 - 0.424 * s.armature_current)


@pytest.mark.parametrize("motor_speed", [0.0, 100.0, 350.0])
def test_slopes_are_difference_quotients(p: SimpleNamespace, motor_speed: float) -> None:
    base = state(integral=0.3, current_integral=0.1 * motor_speed, current=5.0)
    s = stage(p, reference=motor_speed + 1.0, motor_speed=motor_speed)
    drive.solve_drive(base, A, s, p)
    other = stage(p, reference=motor_speed + 1.0, motor_speed=motor_speed + 1e-3)
    other.flux = laws.flux(other, p)
    drive.solve_drive(base, A, other, p)
    drive.move_drive(1e-3, s)
    for name in ("current_reference", "speed_integral", "armature_current", "current_integral"):
        assert getattr(s, name) == pytest.approx(getattr(other, name), rel=1e-6), name
    assert s.armature_voltage == pytest.approx(other.armature_voltage, rel=1e-6)


def test_change_of_limits_is_seen(p: SimpleNamespace) -> None:
    s = stage(p, reference=104.0, motor_speed=100.0)  # wants 60 A
    drive.solve_drive(state(current_integral=18.5, current=60.0), A, s, p)
    assert drive.keeps_limits(0.5, s)
    assert not drive.keeps_limits(-1.0, s)  # would want 75 A
