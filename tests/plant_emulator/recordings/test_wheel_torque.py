"""A truck's torque that nobody measured: estimated, and left open as an unknown input."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.identification.identify import identify
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.recordings.input_noise import noise_directions
from plant_emulator.recordings.recording import Recording, recording
from plant_emulator.recordings.wheel_torque import (
    drum_torque,
    mark_informative,
    with_estimated_torque,
)
from plant_emulator.signals.log import COMPARED, TRUCK, WHEEL_TORQUE, Log
from plant_emulator.signals.noise import noise
from plant_emulator.simulation.sensor_noise import SENSORS, add_noise
from plant_emulator.workflows.loading import load_recordings
from plant_emulator.workflows.simulation import simulate

BenchLog = Callable[[str], Log]


def unmeasured(log: Log) -> Log:
    """The log as if nobody had measured the truck's torque."""
    signals = {name: values for name, values in log.signals.items() if name != WHEEL_TORQUE}
    return replace(log, signals={**signals, TRUCK: np.ones(len(log.time))})


@pytest.fixture(scope="module")
def travel() -> Log:
    """The travel cycle of an unloaded forklift, without noise."""
    return simulate("program6")


def test_estimate_is_the_torque_of_the_truck(nominal: ParameterSet, travel: Log) -> None:
    """Within 3 N m of a torque of some hundred N m in cruise, with the noise of the sensors."""
    noisy = unmeasured(add_noise(travel, 1))
    share = nominal.value("wheel_radius") / nominal.value("drum_radius")
    found = share * drum_torque(noisy, nominal.values())
    true = travel[WHEEL_TORQUE]
    cruise = (travel.time > 12.0) & (travel.time < 18.0)
    assert np.mean(found[cruise]) == pytest.approx(np.mean(true[cruise]), abs=3.0)
    moving = np.abs(travel["drum_speed"]) > 0.5
    assert np.sqrt(np.mean((found - true)[moving] ** 2)) < 0.12 * np.ptp(true)


def test_a_log_without_the_mark_or_with_a_measured_torque_stays(
    nominal: ParameterSet, travel: Log
) -> None:
    p = nominal.values()
    assert with_estimated_torque(travel, p) is travel
    nobody = replace(
        unmeasured(travel), signals={**unmeasured(travel).signals, TRUCK: 0 * travel.time}
    )
    assert with_estimated_torque(nobody, p) is nobody


def test_parked_drum_has_no_torque_until_it_moves(nominal: ParameterSet, travel: Log) -> None:
    found = drum_torque(unmeasured(add_noise(travel, 1)), nominal.values())
    started = travel.time[np.argmax(np.abs(travel["drum_speed"]) > 0.05)]
    first = travel.time[np.argmax(found != 0.0)]
    assert started - 0.5 < first <= started


def unknown(log: Log, parameters: ParameterSet) -> Recording:
    """The recording of a log whose truck's torque nobody measured, as the loader makes it."""
    known = with_estimated_torque(unmeasured(log), parameters.values())
    use = mark_informative(known, parameters.values())
    assert 0.6 < np.mean(use[log.time > 3.0]) < 1.0
    return recording(known, None, dict.fromkeys(COMPARED, use))


def test_noise_of_a_bench_whose_reference_is_never_still_is_that_of_its_sensors(
    nominal: ParameterSet, travel: Log
) -> None:
    """A regulator that answers noise moves the current by some 10 A; its sensor has 0.25 A."""
    moving = np.abs(travel["speed_reference"]) > 1.0
    asked = 1.3 * np.random.default_rng(1).standard_normal(len(travel.time)) * moving
    signals = {**travel.signals, "speed_reference": travel["speed_reference"] + asked}
    driven = simulate(replace(travel, signals=signals), reference="staircase")
    run = load_recordings([unmeasured(add_noise(driven, 1))], nominal)[0][0]
    channels = ("motor_speed", "armature_current", "shaft_torque")
    found = {name: run.noise[run.channels.index(name)] for name in channels}
    assert noise(run.log["armature_current"]) > 5.0
    for name in channels:
        assert 0.9 < found[name] / SENSORS[name][0] < 1.5, name


@pytest.mark.slow
def test_friction_tells_nothing_that_the_unknown_torque_could_not(
    nominal: ParameterSet, travel: Log
) -> None:
    """Under a wrong friction the noise is left; a fifth more hardly shows, 2 % more flux does."""
    stiff = nominal.with_values(
        {"gear_viscous_friction": 1.1 * nominal.value("gear_viscous_friction")}
    )
    run, p = unknown(add_noise(travel, 1), stiff), stiff.values()
    directions = noise_directions(run, p, 0.0)
    assert directions is not None
    base = run.residual(p, 0.0)
    counted = run.use.sum(axis=1)
    assert np.all(np.sum(directions.whiten(base) ** 2, axis=1) < 1.15 * counted)

    def share_left(**values: float) -> float:
        """Of the squares of the change that these values make."""
        other = run.residual({**p, **values}, 0.0) - base
        return float(np.sum(directions.whiten(other) ** 2) / np.sum(other**2))

    assert share_left(gear_viscous_friction=1.2 * p["gear_viscous_friction"]) < 2e-3
    assert share_left(flux_constant_1=1.02 * p["flux_constant_1"]) > 0.05


@pytest.mark.slow
def test_motor_is_found_beside_an_unknown_torque_and_friction_is_left_open(
    nominal: ParameterSet,
) -> None:
    """The bench has a tenth more friction and 2 % more flux, which the estimate does not know."""
    names = ("gear_viscous_friction", "flux_constant_1")
    values = [factor * nominal.value(name) for factor, name in zip((1.1, 1.02), names, strict=True)]
    changed = nominal.with_values(dict(zip(names, values, strict=True)))
    run = unknown(add_noise(simulate("program6", parameters=changed), 1), nominal)
    friction, flux = identify([run], nominal, names).parameters
    assert friction.standard_error > 0.05 * friction.nominal
    assert flux.value == pytest.approx(values[1], abs=4.0 * flux.standard_error)
    assert flux.standard_error < 0.005 * flux.nominal
