"""The sampled loop against the smallest stable masses that another program found.

That program: Floquet multipliers over the poll period of the linear loop in contact.
"""

from dataclasses import replace

import pytest

from gateway.review.stability import SpeedLoop, is_stable, smallest_mass, spectral_radius

INERTIA = 312.71242 / 0.645**2
LOOP = SpeedLoop(period=0.01, dead_time=0.064, averaged=True)
INSTANT = replace(LOOP, averaged=False)


@pytest.mark.parametrize("period", [0.01, 0.02, 0.05, 0.1, 0.2])
def test_averaged_torque_is_stable_down_to_the_lightest_truck(period):
    assert smallest_mass(replace(LOOP, period=period), INERTIA) == 0.0


@pytest.mark.parametrize("dead_time", [0.001, 0.03, 0.064, 0.128])
def test_averaged_torque_is_stable_for_any_dead_time(dead_time):
    assert is_stable(replace(LOOP, dead_time=dead_time), INERTIA / 60.0)


@pytest.mark.parametrize(
    ("error", "mass"), [(-0.2, 141), (-0.1, 71), (0.1, 76), (0.2, 150), (0.28, 210)]
)
def test_a_wrong_drum_inertia_costs_what_the_table_says(error, mass):
    assert smallest_mass(replace(LOOP, inertia_error=error), INERTIA) == pytest.approx(
        mass, rel=0.03
    )


@pytest.mark.parametrize(
    ("dead_time", "period", "mass"),
    [
        (0.064, 0.01, 298),
        (0.064, 0.02, 291),
        (0.064, 0.05, 604),
        (0.001, 0.01, 141),
        (0.001, 0.02, 406),
        (0.001, 0.05, 720),
        (0.03, 0.01, 194),
        (0.03, 0.02, 387),
        (0.128, 0.01, 407),
        (0.128, 0.02, 244),
    ],
)
def test_instantaneous_torque_needs_the_mass_of_the_table(dead_time, period, mass):
    loop = replace(INSTANT, dead_time=dead_time, period=period)
    assert smallest_mass(loop, INERTIA) == pytest.approx(mass, rel=0.12)


@pytest.mark.parametrize(
    ("time_constant", "mass"), [(0.02, 335), (0.05, 471), (0.1, 514), (0.2, 606)]
)
def test_a_filter_on_the_torque_alone_needs_the_mass_of_the_table(time_constant, mass):
    loop = replace(INSTANT, torque_filter=time_constant)
    assert smallest_mass(loop, INERTIA) == pytest.approx(mass, rel=0.05)


@pytest.mark.parametrize(
    ("time_constant", "mass"), [(0.02, 504), (0.05, 663), (0.1, 713), (0.2, 732)]
)
def test_a_filter_on_the_speed_alone_needs_the_mass_of_the_table(time_constant, mass):
    loop = replace(INSTANT, speed_filter=time_constant)
    assert smallest_mass(loop, INERTIA) == pytest.approx(mass, rel=0.2)


def test_the_same_filter_on_both_costs_nothing():
    assert smallest_mass(replace(LOOP, torque_filter=0.05, speed_filter=0.05), INERTIA) == 0.0


def test_no_forklift_is_unstable_for_any_dead_time():
    """Small gain: stable from J_d / r_d^2 = 752 kg on, here up to a few per cent of grid."""
    for period in (0.02, 0.1, 0.2):
        assert smallest_mass(replace(INSTANT, period=period), INERTIA) < 775.0


@pytest.mark.parametrize(("trim", "stable"), [(0.5, True), (0.8, True), (1.0, True), (1.5, False)])
def test_trim_is_stable_up_to_one(trim, stable):
    assert is_stable(replace(LOOP, trim=trim), 0.207) is stable


def test_trim_of_one_and_a_half_grows_by_4_3_per_second():
    """e^0.043 a poll of 10 ms."""
    assert spectral_radius(replace(LOOP, trim=1.5), 0.207) == pytest.approx(1.044, abs=0.01)


def test_the_neutral_speed_of_the_truck_is_no_growth():
    assert spectral_radius(LOOP, 0.207) == pytest.approx(1.0, abs=1e-9)
