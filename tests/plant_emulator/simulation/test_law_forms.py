"""Sizes that differ with the speed and with the load."""

from collections.abc import Callable

import numpy as np

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import Log
from plant_emulator.simulation.law_forms import form_names, size_factors, split_law_forms
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import Settings, simulate_with_steps
from plant_emulator.solver.kernel import Kernel, use_own_effects
from tests.plant_emulator.runs import linear

TIME = np.linspace(0.0, 10.0, 1001)
RUN = inputs_of(linear((0.0, 0.0), (4.0, 300.0), (6.0, 300.0), (9.0, -100.0), duration=10.0))


def shown(speed: np.ndarray) -> Log:
    """A log of these speeds [rad/s]."""
    return Log(TIME, {"motor_speed": speed}, "made")


def test_polynomials_by_hand() -> None:
    """By hand, for u from 0 to 1: sqrt(3) (2 u - 1), sqrt(5) (6 u^2 - 6 u + 1), and for the third
    degree sqrt(7) (20 u^3 - 30 u^2 + 12 u - 1); the sign of the speed does not count.
    """
    log = shown(np.where(TIME < 5.0, 10.0, -10.0) * np.linspace(0.0, 1.0, 1001))
    u = np.minimum(np.linspace(0.0, 1.0, 1001) / 0.99, 1.0)
    expected = [
        np.sqrt(3.0) * (2.0 * u - 1.0),
        np.sqrt(5.0) * (6.0 * u**2 - 6.0 * u + 1.0),
        np.sqrt(7.0) * (20.0 * u**3 - 30.0 * u**2 + 12.0 * u - 1.0),
    ]
    names = form_names("friction_size", [log])
    assert len(names) == 3
    for name, polynomial in zip(names, expected, strict=True):
        (factor,) = size_factors({name: 0.1}, log).values()
        np.testing.assert_allclose(factor, 1.0 + 0.1 * polynomial, atol=1e-9)
    both = size_factors(dict(zip(names, (0.1, 0.2, 0.0), strict=True)), log)
    np.testing.assert_allclose(
        both["friction_size"], 1.0 + 0.1 * expected[0] + 0.2 * expected[1], atol=1e-9
    )


def test_forms_are_those_of_channels_that_every_log_has() -> None:
    torque = Log(TIME, {"motor_speed": TIME, "shaft_torque": TIME}, "made")
    assert len(form_names("friction_size", [torque, torque])) == 6
    assert len(form_names("friction_size", [torque, shown(TIME)])) == 3
    values = dict.fromkeys(form_names("friction_size", [torque]), 0.0)
    assert split_law_forms({"drum_inertia": 300.0, **values}) == ({"drum_inertia": 300.0}, values)


def test_channel_that_stands_still_has_forms_too() -> None:
    factors = size_factors({form_names("size", [shown(TIME)])[0]: 0.1}, shown(0.0 * TIME))
    np.testing.assert_allclose(factors["size"], 1.0 - 0.1 * np.sqrt(3.0))


VISCOUS = """
def drum_torque(value, s, p):
    return value - p.own_size * s.drum_speed
"""
QUADRATIC = """
def drum_torque(value, s, p):
    return value - p.own_size * s.drum_speed * abs(s.drum_speed) / 5.0
"""


def own_run(
    nominal: ParameterSet, kernel: Kernel, factors: dict[str, np.ndarray], size: float
) -> Log:
    """A run with the own effect, in the steps that a fit takes."""
    use_own_effects(kernel.effects["own"])
    settings = Settings(0.3, 2e-5, 0.01, factors=factors)
    return simulate_with_steps(RUN, {**nominal.values(), "own_size": size}, settings)[0]


def test_factor_that_stays_is_another_size(
    nominal: ParameterSet, model_with: Callable[[str], Kernel]
) -> None:
    kernel = model_with(VISCOUS)
    twice = own_run(nominal, kernel, {"own_size": np.full(len(RUN.time), 2.0)}, 40.0)
    plain = own_run(nominal, kernel, {}, 80.0)
    for name in ("motor_speed", "drum_speed", "shaft_torque"):
        assert np.ptp(plain[name]) > 5.0
        np.testing.assert_allclose(twice[name], plain[name], atol=2e-3 * np.ptp(plain[name]))


def test_factor_that_follows_the_speed_is_another_law(
    nominal: ParameterSet, model_with: Callable[[str], Kernel]
) -> None:
    """A viscous friction whose size grows with the speed is a quadratic one."""
    kernel = model_with(QUADRATIC)
    other = own_run(nominal, kernel, {}, 40.0)
    factors = {"own_size": np.abs(other["drum_speed"]) / 5.0}
    found = own_run(nominal, model_with(VISCOUS), factors, 40.0)
    without = own_run(nominal, model_with(VISCOUS), {}, 1e-9)
    effect = np.linalg.norm(other["shaft_torque"] - without["shaft_torque"])
    missed = np.linalg.norm(other["shaft_torque"] - found["shaft_torque"])
    assert effect > 100.0
    assert missed < 0.05 * effect
