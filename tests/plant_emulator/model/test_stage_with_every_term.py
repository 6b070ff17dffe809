"""One stage with every term that the thesis neglects, so that an effect can rely on it."""

from collections.abc import Iterator
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plant_emulator.model import drive, implicit_stage, stage
from tests import reference_plant as thesis
from tests.plant_emulator.model.test_plant import TABLE, size

TERMS = (
    "motor_coulomb_friction",
    "motor_viscous_friction",
    "motor_shaft_damping",
    "gear_torque",
    "drum_coulomb_friction",
    "drum_viscous_friction",
    "converter_voltage_drop",
)


@pytest.fixture(scope="module", autouse=True)
def every_term_present() -> Iterator[None]:
    """Each neglected law gives the value in p of its own name, as the law of an effect would."""
    with pytest.MonkeyPatch.context() as patch:
        for name in TERMS:
            for module in (implicit_stage, drive):
                if hasattr(module, name):
                    patch.setattr(module, name, lambda s, p, name=name: getattr(p, name))
        yield


def unbalanced(torque: float, speed: float, level: float) -> float:
    """What is left of a torque after Coulomb friction of that level on a body of that speed."""
    if speed == 0.0:
        return max(0.0, abs(torque) - level)
    return torque - level if speed > 0.0 else torque + level


@settings(max_examples=400, deadline=None)
@given(
    a=st.sampled_from([1e-5, 1e-4, 3e-4, 3e-3]),
    motor=st.one_of(st.just(0.0), size(1e-4, 300.0)),
    slip=size(1e-6, 0.05),
    drum_slip=st.one_of(st.just(0.0), size(1e-6, 1.0)),
    drum_at_rest=st.booleans(),
    gap=st.floats(-0.16, 0.16),
    twist=size(1e-8, 3e-5),
    current=st.floats(-10.0, 10.0),
    motor_level=st.sampled_from([0.0, 0.6, 20.0]),
    drum_level=st.sampled_from([0.0, 25.0, 900.0]),
    damping=st.sampled_from([0.0, 5.0]),
    viscous=st.sampled_from([0.0, 0.01]),
    wheel_torque=st.sampled_from([0.0, 100.0, -100.0]),
    gear_torque=st.sampled_from([0.0, 40.0, -40.0]),
)
def test_stage_balances_every_torque(
    a: float, motor: float, slip: float, drum_slip: float, drum_at_rest: bool, gap: float,
    twist: float, current: float, motor_level: float, drum_level: float, damping: float,
    viscous: float, wheel_torque: float, gear_torque: float,
) -> None:  # fmt: skip
    p = SimpleNamespace(
        **vars(TABLE), motor_coulomb_friction=motor_level, motor_viscous_friction=viscous,
        motor_shaft_damping=damping, gear_torque=gear_torque, drum_coulomb_friction=drum_level,
        drum_viscous_friction=100.0 * viscous, converter_voltage_drop=3.0,
    )  # fmt: skip
    gear = motor / 62.6 + slip
    drum = 0.0 if drum_at_rest else gear + drum_slip
    base = [0.01 * current, 0.1 * motor, current, motor, twist, gear, gap, drum]
    s = SimpleNamespace(**dict.fromkeys(stage.STAGE, 0.0))
    vars(s).update(zip(stage.STATES, base, strict=True))
    s.delayed_reference, s.wheel_torque = motor, wheel_torque
    implicit_stage.solve_stage(base, a, s, p)

    omega_m, omega_g, omega_d = s.motor_speed, s.gear_speed, s.drum_speed
    closing = omega_g - omega_d
    T_mg = thesis.k_mg * (twist + a * (omega_m - 62.6 * omega_g))
    T_mg += damping * (omega_m - 62.6 * omega_g)
    d = gap + a * closing
    T_gd = thesis.k_gd * thesis.dead_zone(d + thesis.c / thesis.k_gd * closing)

    torque = thesis.k_phi(omega_m) * s.armature_current - T_mg - viscous * omega_m
    torque -= thesis.J_m * (omega_m - motor) / a
    assert abs(unbalanced(torque, omega_m, motor_level)) <= 1e-4 + 1e-7 * abs(motor) / a
    torque = 62.6 * T_mg - T_gd - gear_torque - thesis.J_g * (omega_g - gear) / a
    level = thesis.f_gc + thesis.f_g * abs(omega_g) ** thesis.delta_g
    assert abs(unbalanced(torque, omega_g, level)) <= 1e-2
    torque = T_gd + 645 / 171.5 * wheel_torque - 100.0 * viscous * omega_d
    torque -= thesis.J_d * (omega_d - drum) / a
    assert abs(unbalanced(torque, omega_d, drum_level)) <= 1e-3
    voltage = s.armature_voltage - 0.424 * s.armature_current - 3.0
    voltage -= thesis.k_phi(omega_m) * omega_m
    assert thesis.L_a * (s.armature_current - current) / a == pytest.approx(voltage, abs=1e-3)
