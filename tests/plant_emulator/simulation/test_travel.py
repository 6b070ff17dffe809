"""Programs 6 and 6L in a loop of our own against the independent bench's logs."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import COMPARED, Log
from plant_emulator.simulation.fit_metrics import fit, validate
from plant_emulator.simulation.programs import TravelProgram, program
from plant_emulator.simulation.travel_program import ThesisReference, simulate_travel
from plant_emulator.simulation.truck import Forklift, PiDriver

ReadLog = Callable[[str], Log]


def run(name: str, nominal: ParameterSet) -> Log:
    known = program(name)
    assert isinstance(known, TravelProgram)
    return simulate_travel(known, nominal)


@pytest.mark.parametrize("name", ["program6", "program6L"])
def test_loop_around_the_bench_reproduces_the_independent_log(
    name: str, nominal: ParameterSet, bench_log: ReadLog
) -> None:
    log, found = bench_log(f"bench_nominal/{name}"), run(name, nominal)
    for signal in ("wheel_torque", "speed_reference"):
        assert 100.0 * fit(log[signal], found[signal]).nrmsd <= 0.1, signal
    for channel, measures in validate(log, found).items():
        assert 100.0 * measures.nrmsd <= 0.15, (channel, 100.0 * measures.nrmsd)


@pytest.mark.parametrize("mass", [3640.0, 5240.0])
def test_pi_driver_on_the_drum_feels_the_road_load(mass: float, nominal: ParameterSet) -> None:
    truck = Forklift(mass=mass)
    known = TravelProgram(name="pi", duration=22.0, mass=mass)
    log = simulate_travel(known, nominal, driver=PiDriver(truck))
    cruise = (log.time > 14.0) & (log.time < 21.9)
    force = log["wheel_torque"][cruise].mean() / truck.wheel_radius
    assert force == pytest.approx(truck.road_load(14 / 3.6), rel=0.03)
    assert 0.645 * log["drum_speed"][cruise].mean() == pytest.approx(14 / 3.6, rel=5e-3)


def test_reference_is_never_negative(nominal: ParameterSet) -> None:
    assert run("program6", nominal)["speed_reference"].min() == 0.0


@pytest.mark.slow
def test_drum_stands_while_the_truck_is_parked(nominal: ParameterSet) -> None:
    log = run("program6", nominal)
    assert not log["drum_speed"][log.time <= 2.0].any()


def test_effect_acts_in_the_loop(nominal: ParameterSet) -> None:
    known = TravelProgram(name="short", duration=6.0, mass=3640.0)
    plain = simulate_travel(known, nominal)
    lagging = simulate_travel(known, nominal, {"torque_sensor_lag": {"time_constant": 0.2}})
    assert set(COMPARED) < set(lagging.signals)
    assert np.abs(plain["drum_speed"] - lagging["drum_speed"]).max() > 0.01


def test_regulator_by_hand(nominal: ParameterSet) -> None:
    """One cycle of eq. 4.4 with 4.8, 4.9, 4.12 in the integrated form, numbers of Table 3.1."""
    truck = Forklift(mass=3640.0, crr=0.0117, crr_v=0.0)
    regulator = ThesisReference(nominal, truck)
    regulator.drum_reference, regulator._drum_speed = 3.0, 2.95
    friction = 35.989 + 345.38 * 3.0**0.4418
    wheel = friction + 62.6 * -5.0 - 3640 * 9.81 * 0.0117 * 0.645
    inertia = 3640 * 0.645**2
    expected = 3.0 + 312.71 / inertia * 0.05 + wheel / inertia * 0.01
    assert regulator.update(-5.0, 3.0) == pytest.approx(62.6 * expected, rel=1e-6)
