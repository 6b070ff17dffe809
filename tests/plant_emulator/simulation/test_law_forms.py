"""Sizes that differ with the speed and with the load."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.estimation.residuals import run_residual
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.sensors import Sensor
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import COMPARED, Log
from plant_emulator.simulation.law_forms import form_names, size_factors, split_law_forms
from plant_emulator.simulation.run_inputs import RunInputs, inputs_of
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
    names = form_names("friction_size")[:3]
    for name, polynomial in zip(names, expected, strict=True):
        (factor,) = size_factors({name: 0.1}, log).values()
        np.testing.assert_allclose(factor, 1.0 + 0.1 * polynomial, atol=1e-9)
    both = size_factors(dict(zip(names, (0.1, 0.2, 0.0), strict=True)), log)
    np.testing.assert_allclose(
        both["friction_size"], 1.0 + 0.1 * expected[0] + 0.2 * expected[1], atol=1e-9
    )


@pytest.mark.parametrize("channel", ["motor_speed", "shaft_torque", "armature_current"])
def test_each_channel_has_forms_of_its_own(channel: str, bench_log: Callable[[str], Log]) -> None:
    """By hand: where a channel is at its largest, sqrt(3) (2 u - 1) is sqrt(3)."""
    log, name = bench_log("bench_nominal/program1"), f"size by {channel} 1"
    assert name in form_names("size")
    (factor,) = size_factors({name: 0.1}, log).values()
    largest = np.argmax(np.abs(log[channel]))
    assert factor[largest] == pytest.approx(1.0 + 0.1 * np.sqrt(3.0))


def test_log_without_a_current_has_no_forms_of_it() -> None:
    assert size_factors({"size by armature_current 1": 0.1}, shown(TIME)) == {}


def test_forms_are_told_from_the_values_of_the_model() -> None:
    forms = dict.fromkeys(form_names("friction_size"), 0.0)
    assert len(forms) == 9
    assert split_law_forms({"drum_inertia": 300.0, **forms}) == ({"drum_inertia": 300.0}, forms)


def test_channel_that_hardly_moves_has_forms_too() -> None:
    speed = 0.0 * TIME
    speed[500:505] = 10.0
    speed[600] = np.nan
    factors = size_factors({form_names("size")[0]: 0.1}, shown(speed))
    moving = np.isin(np.arange(1001), range(500, 505))
    end = 0.1 * np.sqrt(3.0)
    np.testing.assert_allclose(factors["size"], np.where(moving, 1.0 + end, 1.0 - end))


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


INERT = {"drum_bearing_friction_coulomb": 20.0}


def parts(run: RunInputs, values: dict[str, float], settings: Settings) -> tuple[Log, Log]:
    """The run as a whole, and cut in pieces by a factor of 1."""
    factors = {name: np.ones(len(run.time)) for name in INERT}
    cut = settings._replace(factors=factors)
    return tuple(simulate_with_steps(run, values, s)[0] for s in (settings, cut))  # type: ignore[return-value]


@pytest.mark.parametrize("kind", ["free", "led", "sensor", "truck", "short"])
def test_run_in_pieces_is_the_run(
    kind: str, nominal: ParameterSet, bench_log: Callable[[str], Log]
) -> None:
    values = {**nominal.values(), **INERT}
    log = bench_log("bench_nominal/program1")
    settings = Settings(0.3, 1e-7, 0.01)
    if kind == "truck":
        log = bench_log("bench_nominal/program4")
    elif kind == "short":
        log = Log(log.time[:12], {n: v[:12] for n, v in log.signals.items()}, "short")
    sensors = {"shaft_torque": Sensor(time_constant=0.05)} if kind == "sensor" else {}
    run = inputs_of(log, sensors=sensors)
    if kind == "led":
        settings = settings._replace(along=recording(log).measured_speeds(0.2))
    whole, cut = parts(run, values, settings)
    for name in COMPARED:
        np.testing.assert_allclose(cut[name], whole[name], atol=1e-3 * np.ptp(whole[name]) + 1e-9)


def test_coefficient_of_a_form_reaches_the_residual_of_a_recording(
    nominal: ParameterSet, bench_log: Callable[[str], Log]
) -> None:
    log = bench_log("bench_nominal/program1")
    own = recording(log)
    residual = run_residual(own, nominal.values(), 1e-6, 0.01)
    name = form_names("drum_bearing_friction_coulomb")[0]
    found = residual({**INERT, GAP_POSITION: 0.3, name: 0.1})
    factors = size_factors({name: 0.1}, log)
    settings = Settings(0.3, 1e-6, 0.01, factors=factors)
    expected, _ = simulate_with_steps(own.inputs, {**nominal.values(), **INERT}, settings)
    np.testing.assert_allclose(found, own.residual_of(expected))
    assert np.linalg.norm(found - residual({**INERT, GAP_POSITION: 0.3})) > 1.0


def test_factor_of_a_neutral_effect_changes_nothing(nominal: ParameterSet) -> None:
    values = {**nominal.values(), "drum_bearing_friction_coulomb": 0.0}
    whole, cut = parts(RUN, values, Settings(0.3, 2e-5, 0.01))
    np.testing.assert_array_equal(cut["drum_speed"], whole["drum_speed"])
