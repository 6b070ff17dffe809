"""The equations of motion: one stage against the thesis's right-hand side, and what must hold."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from plant_emulator.model import drum as drum_equation
from plant_emulator.model import implicit_stage, stage
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.simulation.running_bench import Bench
from tests import reference_plant as thesis
from tests.plant_emulator.runs import (
    BACKLASH,
    CURRENT,
    DRUM,
    GEAR,
    MOTOR,
    TWIST,
    Piecewise,
    largest,
    linear,
    simulate,
    with_truck,
)

BREAKAWAY = 35.989 / 62.6  # torque at the motor side that the gear withstands at rest [N m]


# --- dead zone --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("y", "expected"),
    [(0.0, 0.0), (0.1, 0.0), (-0.15, 0.0), (0.15, 0.0), (0.25, 0.1), (-0.25, -0.1)],
)
def test_dead_zone_by_hand(y: float, expected: float) -> None:
    assert drum_equation.dead_zone(y, 0.15) == pytest.approx(expected)


@given(y=st.floats(-10.0, 10.0), step=st.floats(0.0, 1.0), half_gap=st.floats(0.0, 1.0))
def test_dead_zone_is_odd_and_rises_by_no_more_than_its_argument(
    y: float, step: float, half_gap: float
) -> None:
    assert drum_equation.dead_zone(-y, half_gap) == -drum_equation.dead_zone(y, half_gap)
    rise = drum_equation.dead_zone(y + step, half_gap) - drum_equation.dead_zone(y, half_gap)
    assert -1e-12 <= rise <= step + 1e-12


def test_friction_takes_up_to_its_level_and_leaves_the_rest() -> None:
    beyond = [drum_equation.torque_beyond_friction(t, 2.0) for t in (5.0, 2.0, -1.0, -2.0, -5.0)]
    assert beyond == [3.0, 0.0, 0.0, 0.0, -3.0]


# --- one stage --------------------------------------------------------------------------------


def size(smallest: float, largest: float) -> st.SearchStrategy[float]:
    """Numbers of either sign, their sizes spread evenly over the powers of ten."""
    exponent = st.floats(np.log10(smallest), np.log10(largest))
    return st.builds(lambda e, sign: sign * 10**e, exponent, st.sampled_from([-1.0, 1.0]))


@settings(max_examples=400, deadline=None)
@given(
    a=st.sampled_from([1e-6, 1e-5, 1e-4, 3e-4, 3e-3]),
    gear=size(1e-7, 7.0),
    estimate=size(1e-7, 1.0),
    slip=size(1e-5, 0.1),
    current=st.floats(-20.0, 20.0),
    twist=size(1e-8, 3e-5),
    gap=st.floats(-0.16, 0.16),
    drum=size(1e-6, 1.0),
    error=st.floats(-1.0, 1.0),
    wheel_torque=st.sampled_from([0.0, 400.0, -300.0]),
)
def test_stage_solves_the_equations_of_the_thesis(
    a: float, gear: float, estimate: float, slip: float, current: float, twist: float,
    gap: float, drum: float, error: float, wheel_torque: float,
) -> None:  # fmt: skip
    """(X - base) / a = f(X), f typed in tests/reference_plant.py; stick within its level."""
    motor = 62.6 * gear + slip
    base = [0.01 * current, 0.1 * motor, current, motor, twist, gear, gap, gear + drum]
    s = SimpleNamespace(**dict.fromkeys(stage.STAGE, 0.0))
    vars(s).update(zip(stage.STATES, base, strict=True))
    s.gear_speed = gear + estimate
    s.delayed_reference, s.wheel_torque = motor + error, wheel_torque
    implicit_stage.solve_stage(base, a, s, TABLE)
    found = [getattr(s, name) for name in stage.STATES]

    # Where the integral of one step lies between a current reference below its limit and one above,
    # the anti-windup has no solution: integrating exceeds the limit, and not integrating does not.
    speed_error = s.delayed_reference - found[MOTOR]
    wanted = thesis.K_ps * (speed_error + found[0] / thesis.T_is)
    within_a_step = thesis.K_ps * abs(speed_error) * a / thesis.T_is
    assume(abs(abs(wanted) - thesis.i_max) > within_a_step)

    omega_g = found[GEAR]
    friction = thesis.friction(omega_g, sign=np.sign) if omega_g else s.gear_friction_torque
    assert abs(s.gear_friction_torque) <= thesis.f_gc or omega_g != 0.0
    slopes = thesis.rates(found, s.delayed_reference, wheel_torque, T_f=friction)
    left = [abs(x - x_0 - a * f) for x, x_0, f in zip(found, base, slopes, strict=True)]
    # torques unbalanced: 1e-4 N m at the gear, where thousands act
    allowed = [1e-7, 1e-7, 1e-5, 1e-5, 1e-12, 1e-4 * a / thesis.J_g, 1e-12, 1e-9]
    assert all(one <= limit for one, limit in zip(left, allowed, strict=True)), left


def _table() -> SimpleNamespace:
    """The numbers of the reference plant under the names of the emulator."""
    t = thesis
    return SimpleNamespace(
        armature_resistance=t.R_a, armature_inductance=t.L_a, motor_inertia=t.J_m,
        flux_constant=t.K_m, flux_constant_1=t.K_1, flux_constant_2=t.K_2,
        gear_inertia=t.J_g, gear_ratio=t.xi, drum_inertia=t.J_d,
        motor_shaft_stiffness=t.k_mg, drum_shaft_stiffness=t.k_gd, drum_shaft_damping=t.c,
        gear_coulomb_friction=t.f_gc, gear_viscous_friction=t.f_g,
        gear_friction_exponent=t.delta_g, backlash_half_gap=t.alpha,
        speed_gain=t.K_ps, speed_integral_time=t.T_is, current_gain=t.K_pc,
        current_integral_time=t.T_ic, dead_time=t.b, voltage_limit=t.u_max,
        armature_current_limit=t.i_max, speed_limit=t.omega_max,
        drum_radius=t.r_d, wheel_radius=t.r_w,
    )  # fmt: skip


TABLE = _table()


# --- rest and steady motion -------------------------------------------------------------------


def test_bench_without_reference_does_not_move_at_all(nominal: ParameterSet) -> None:
    log = simulate(linear((0.0, 0.0), duration=5.0), nominal.values())
    assert not any(log[name].any() for name in ("motor_speed", "drum_speed", "shaft_torque"))


def test_gear_pushed_below_breakaway_stands_exactly_still(nominal: ParameterSet) -> None:
    bench = Piecewise(nominal.values())
    bench.to(0.01, 0.005)
    for k in range(2, 101):
        channels = bench.to(0.01 * k, 0.005)
        assert bench.x[GEAR] == 0.0
        assert bench.x[DRUM] == 0.0
    # 0.005 rad/s ask for 0.15 A after 1 s: i R_a and the current integrator's error aside
    assert 0.2 < -channels[-1, 3] < BREAKAWAY


def test_gear_breaks_away_at_its_coulomb_friction(nominal: ParameterSet) -> None:
    """0.5 rad/s ask for 7.5 A (1 + t): 13.9 N m. Before the gear moves the shaft takes 0.575."""
    bench = Piecewise(nominal.values())
    moved_at = []
    torques = [0.0]
    for k in range(1, 2000):
        channels = bench.to(1e-4 * k, 0.05 * min(1.0, k / 1000))
        torques.append(-channels[-1, 3])
        if bench.x[GEAR] != 0.0:
            moved_at.append(k)
            break
    assert moved_at
    assert torques[-2] <= BREAKAWAY <= 1.05 * torques[-1]


def test_steady_speed_needs_exactly_the_friction_torque(nominal: ParameterSet) -> None:
    bench = Piecewise(nominal.values())
    bench.to(5.0, 300.0)
    bench.to(60.0, 300.0)
    gear_speed = 300.0 / 62.6
    friction = 35.989 + 345.38 * gear_speed**0.4418
    assert bench.x[MOTOR] == pytest.approx(300.0, rel=1e-6)
    assert bench.x[TWIST] * 81096 * 62.6 == pytest.approx(friction, rel=1e-4)
    assert bench.x[CURRENT] * 366.83 / (8.0644 + 300.0) == pytest.approx(friction / 62.6, rel=1e-4)


def test_warm_gear_at_4025_rpm_takes_15_7_ampere_and_13_4_newton_metres(
    nominal: ParameterSet,
) -> None:
    """The steady end of the thesis's temperature test (Fig. 3.7)."""
    speed = 4025 * 2 * np.pi / 60
    log = simulate(linear((0.5, 0.0), (6.5, speed), duration=40.0, period=0.1), nominal.values())
    assert log["armature_current"][-1] == pytest.approx(15.7, abs=0.05)
    assert log["shaft_torque"][-1] == pytest.approx(-13.4, abs=0.05)
    assert log["motor_speed"][-1] == pytest.approx(speed, rel=1e-5)


def test_steady_voltage_is_back_emf_plus_resistance(nominal: ParameterSet) -> None:
    log = simulate(linear((0.0, 0.0), (4.0, 380.0), duration=40.0, period=0.1), nominal.values())
    current, back_emf = log["armature_current"][-1], 366.83 / 388.0644 * 380.0
    assert log["armature_voltage"][-1] == pytest.approx(back_emf + 0.424 * current, rel=1e-5)


# --- symmetry and energy ----------------------------------------------------------------------


def test_mirrored_reference_gives_mirrored_run(nominal: ParameterSet) -> None:
    corners = ((0.1, 0.0), (1.0, 250.0), (1.5, 250.0), (2.5, -200.0), (3.5, 0.0))
    values = nominal.values()
    run = simulate(linear(*corners, duration=5.0), values, gap_position=0.4)
    mirror = linear(*((t, -w) for t, w in corners), duration=5.0)
    mirrored = simulate(mirror, values, gap_position=-0.4)
    for name in ("motor_speed", "drum_speed", "armature_current", "shaft_torque"):
        np.testing.assert_array_equal(run[name], -mirrored[name])


def energy(x: np.ndarray) -> float:
    """Kinetic, elastic and magnetic energy [J], numbers of Table 3.1."""
    motion = 0.128 * x[MOTOR] ** 2 + 0.02242 * x[GEAR] ** 2 + 312.69 * x[DRUM] ** 2
    shafts = 81096 * x[TWIST] ** 2 + 1.3493e6 * thesis.dead_zone(x[BACKLASH]) ** 2
    return 0.5 * float(motion + shafts + 0.004 * x[CURRENT] ** 2)


@settings(max_examples=40, deadline=None)
@given(
    speeds=st.tuples(*[st.floats(-5.0, 5.0)] * 2),
    gap=st.floats(-0.155, 0.155),
    twist=st.floats(-1e-3, 1e-3),
)
def test_free_bench_only_loses_energy(
    nominal: ParameterSet, speeds: tuple[float, float], gap: float, twist: float
) -> None:
    """The armature is short-circuited: no voltage, so nothing puts energy in."""
    bench = Piecewise({**nominal.values(), "voltage_limit": 1e-12})
    bench.x[:8] = [0.0, 0.0, 0.0, 62.6 * speeds[0], twist, speeds[0], gap, speeds[1]]
    before = first = energy(bench.x)
    for k in range(1, 101):
        bench.to(0.01 * k, 0.0)
        now = energy(bench.x)
        assert now <= before + 1e-12 * (first + 1.0)
        before = now


@settings(max_examples=25, deadline=None)
@given(
    speeds=st.lists(st.floats(-505.0, 505.0), min_size=8, max_size=8),
    spacing=st.sampled_from([0.02, 0.1, 0.5]),
    gap_position=st.floats(-1.0, 1.0),
)
def test_any_reference_within_limits_gives_finite_bounded_states(
    nominal: ParameterSet, speeds: list[float], spacing: float, gap_position: float
) -> None:
    corners = [(0.1, 0.0), *((0.1 + spacing * (k + 1), w) for k, w in enumerate(speeds))]
    inputs = linear(*corners, duration=round(0.3 + 9 * spacing, 2))
    log = simulate(inputs, nominal.values(), gap_position=gap_position)
    for name, signal in log.signals.items():
        assert np.isfinite(signal).all(), name
    assert largest(log["armature_voltage"]) <= 400.0
    assert largest(log["armature_current"]) < 110.0
    assert largest(log["motor_speed"]) < 600.0


# --- the gap ----------------------------------------------------------------------------------


@pytest.mark.parametrize("gap_position", [-1.0, -0.5, 0.0, 0.5])
def test_drum_starts_when_the_free_part_of_the_gap_is_used_up(
    nominal: ParameterSet, gap_position: float
) -> None:
    """theta_g + (c / k_gd) omega_g reaches (1 - position) alpha: the contact of eq. 3.29-3.31."""
    bench = Piecewise(nominal.values(), gap_position=gap_position)
    while bench.x[DRUM] == 0.0:
        bench.to(bench.time + 1e-3, bench.reference + 0.08)
        assert bench.time < 3.0
    turned = bench.x[BACKLASH] - gap_position * 0.15073
    closing = 1.2032e5 / 1.3493e6 * bench.x[GEAR]
    assert turned + closing == pytest.approx((1.0 - gap_position) * 0.15073, rel=0.02)


def test_drum_in_contact_starts_with_the_gear(nominal: ParameterSet) -> None:
    bench = Piecewise(nominal.values(), gap_position=1.0)
    while bench.x[GEAR] == 0.0:
        assert bench.x[DRUM] == 0.0
        bench.to(bench.time + 1e-3, bench.reference + 0.08)
    bench.to(bench.time + 1e-3, bench.reference + 0.08)
    assert bench.x[DRUM] > 0.0


# --- truck ------------------------------------------------------------------------------------


def test_parked_truck_holds_the_drum_exactly(nominal: ParameterSet) -> None:
    inputs = linear((0.1, 0.0), (0.6, 60.0), duration=2.0)
    noise = np.where(np.arange(201) % 2, 4.0, -4.0)  # what a sensor shows of a parked truck
    start = np.where(inputs.time > 1.5, 400.0, noise)
    held = simulate(with_truck(inputs, start), nominal.values())
    assert not held["drum_speed"][inputs.time <= 1.5].any()
    assert held["drum_speed"][-1] > 0.0
    assert largest(held["shaft_torque"]) > 5.0  # the motor turns the gear against the held drum


def test_wheel_torque_accelerates_the_free_drum_by_the_radii_and_its_inertia(
    nominal: ParameterSet,
) -> None:
    bench = Piecewise(nominal.values(), gap_position=0.0)
    bench.to(0.1, 0.0, wheel_torque=50.0)
    assert bench.x[DRUM] == pytest.approx(0.645 / 0.1715 * 50.0 / 312.69 * 0.1, rel=1e-9)


def test_brake_holds_a_standing_drum_up_to_its_level_and_reports_its_reaction(
    nominal: ParameterSet,
) -> None:
    bench = Bench(nominal)
    held = bench.advance([0.0] * 10, wheel_torque=100.0, brake_torque=100.5)
    assert not held.drum_speed.any()
    assert held.wheel_torque == pytest.approx(0.0, abs=1e-9)  # drive and reaction cancel
    slipping = bench.advance([0.0] * 10, wheel_torque=100.0, brake_torque=60.0)
    assert slipping.drum_speed[-1] == pytest.approx(0.645 / 0.1715 * 40.0 / 312.69 * 0.01)
    assert slipping.wheel_torque == pytest.approx(40.0)


def test_brake_stops_the_moving_drum_and_does_not_turn_it_round(nominal: ParameterSet) -> None:
    bench = Bench(nominal)
    bench.advance([0.0] * 50, wheel_torque=100.0)
    braking = bench.advance([0.0], brake_torque=300.0)
    assert braking.wheel_torque == pytest.approx(-300.0)
    stopped = bench.advance([0.0] * 200, brake_torque=300.0)
    assert (stopped.drum_speed >= 0.0).all()
    assert stopped.drum_speed[-1] == 0.0
    assert stopped.wheel_torque > -300.0
