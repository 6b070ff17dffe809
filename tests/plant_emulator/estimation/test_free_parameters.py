"""On which scale parameters are estimated."""

import pytest

from plant_emulator.estimation.free_parameters import unknowns
from plant_emulator.model.parameters import ParameterSet

FLUX = ("flux_constant_1", "flux_constant_2")


def test_half_way_between_two_weakened_fluxes_that_agree_at_a_speed_the_flux_is_the_same(
    nominal: ParameterSet,
) -> None:
    """By hand: c_1 / (c_2 + 390) is 1 with 400 and 10, with 420 and 30, and with 410 and 20."""
    pair = unknowns(nominal, FLUX, nominal.values(), ())
    ends = [(400.0, 10.0), (420.0, 30.0)]
    half = [
        u.value(0.5 * (u.scaled(ends[0][k]) + u.scaled(ends[1][k]))) for k, u in enumerate(pair)
    ]
    assert half[0] / (half[1] + 390.0) == pytest.approx(1.0, rel=1e-12)


def test_other_parameters_change_by_factors(nominal: ParameterSet) -> None:
    (inertia,) = unknowns(nominal, ("drum_inertia",), nominal.values(), ())
    half = inertia.value(0.5 * (inertia.scaled(100.0) + inertia.scaled(400.0)))
    assert half == pytest.approx(200.0)
