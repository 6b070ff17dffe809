"""The noise of a fed wheel torque, against draws of it, and what it does to an identification."""

from itertools import count
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array

from plant_emulator.errors import UnsettledError
from plant_emulator.identification.identify import identify
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.recordings.holes import bridge_holes
from plant_emulator.recordings.input_noise import NoiseDirections, noise_directions
from plant_emulator.recordings.recording import Recording, recording
from plant_emulator.recordings.stamps import restamp
from plant_emulator.signals.log import Log, compared_channels
from plant_emulator.simulation.programs import TravelProgram, program
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import SENSORS, add_noise
from plant_emulator.simulation.simulate import simulate
from plant_emulator.simulation.travel_program import simulate_travel

GAP = 0.3


@pytest.fixture(scope="module")
def true_log(nominal: ParameterSet) -> Log:
    """Program 6 without noise."""
    known = program("program6")
    assert isinstance(known, TravelProgram)
    return simulate_travel(known, nominal, gap_position=GAP)


@pytest.fixture(scope="module")
def measured(true_log: Log) -> Recording:
    return recording(add_noise(true_log, 1))


def test_direction_of_deviation_three_comes_out_with_variance_one() -> None:
    direction = np.zeros((2, 50))
    direction[0, 10], direction[1, 11] = 0.6, 0.8
    random = np.random.default_rng(1)
    draws = [
        random.standard_normal((2, 50)) + 3.0 * random.standard_normal() * direction
        for _ in range(4000)
    ]
    one = NoiseDirections(
        directions=csr_array(direction.T.reshape(1, -1)), deviations=np.array([3.0])
    )
    along = [float(np.sum(direction * one.whiten(r))) for r in draws]
    assert np.var(along) == pytest.approx(1.0, abs=0.1)
    across = one.whiten(draws[0]) - draws[0]
    assert np.count_nonzero(across) == 2, "all else stays"


@pytest.mark.slow
def test_directions_hold_what_drawn_noise_of_the_wheel_torque_does(
    measured: Recording, true_log: Log, nominal: ParameterSet
) -> None:
    """Two gaps close while the truck drives: at its start, and when it brakes."""
    found = noise_directions(measured, nominal.values(), GAP)
    assert found is not None
    shape = (-1, len(true_log.time), len(measured.channels))
    spikes = np.abs(found.directions.toarray().reshape(shape)).max(axis=2).argmax(axis=1)
    assert sorted(np.round(true_log.time[spikes], 1).tolist()) == [2.4, 22.6]
    random, torque = np.random.default_rng(2), true_log["wheel_torque"]
    base = measured.with_wheel_torque(torque).residual(nominal.values(), GAP)
    deviation = SENSORS["wheel_torque"][0]
    raw, quiet = [], []
    for _ in range(8):
        fed = measured.with_wheel_torque(torque + deviation * random.standard_normal(len(torque)))
        change = fed.residual(nominal.values(), GAP) - base
        raw.append(found.along(change))
        quiet.append(found.along(found.whiten(change)))
    assert np.mean(np.square(raw)) > 20.0
    assert np.mean(np.square(quiet)) < 2.0


def test_samples_that_do_not_count_stay_zero(true_log: Log, nominal: ParameterSet) -> None:
    counted = true_log.time < 22.55
    log = add_noise(true_log, 1)
    part = recording(log, use={"armature_current": counted})
    found = noise_directions(part, nominal.values(), GAP)
    assert found is not None
    row = part.channels.index("armature_current")
    quiet = found.whiten(part.residual(nominal.values(), GAP))
    assert not quiet[row, ~counted].any()


@pytest.mark.slow
def test_log_without_a_truck_feeds_nothing(nominal: ParameterSet, true_log: Log) -> None:
    signals = {k: v for k, v in add_noise(true_log, 1).signals.items() if k != "wheel_torque"}
    alone = recording(Log(true_log.time, signals, true_log.source))
    assert noise_directions(alone, nominal.values(), GAP) is None


def test_what_a_hole_hides_of_an_input_is_noise(true_log: Log, nominal: ParameterSet) -> None:
    """The truck begins to brake in the hole, and the drum then flies through the gap.

    When it began nobody knows. The contact is early or late, and stands 40 times over the noise.
    """
    log = add_noise(true_log, 1)
    kept = (log.time <= 21.74) | (log.time >= 22.07)
    signals = {name: values[kept] for name, values in log.signals.items()}
    every = dict.fromkeys(compared_channels(log), np.ones(int(kept.sum()), bool))
    bridged, use = bridge_holes(Log(log.time[kept], signals, log.source), every)
    run = recording(bridged, use=use)
    found = noise_directions(run, nominal.values(), GAP)
    assert found is not None
    contact = (bridged.time > 22.5) & (bridged.time < 23.0)
    residual = run.residual(nominal.values(), GAP)
    left = found.whiten(residual)
    assert np.sum(residual[:, contact] ** 2) > 500.0 + np.sum(left[:, contact] ** 2)
    assert np.mean(left[:, contact] ** 2) < 1.5


def test_step_that_a_hole_hides_does_not_count(nominal: ParameterSet) -> None:
    """The motor brakes from 350 to 300 rad/s in the hole, and the drum flies through the gap.

    No sum of directions holds what a step at a wrong time makes of the contact behind the hole.
    """
    time = np.arange(0.0, 16.0, 0.01)
    corners = [(0.0, 0.0), (1.0, 0.0), (8.0, 350.0), (12.15, 350.0), (12.23, 300.0)]
    asked = np.interp(time, *np.transpose(corners))
    exact = simulate(inputs_of(Log(time, {"speed_reference": asked})), nominal.values())
    log = add_noise(exact, 1)
    kept = (time <= 12.1) | (time >= 12.47)
    signals = {name: values[kept] for name, values in log.signals.items()}
    every = dict.fromkeys(compared_channels(log), np.ones(int(kept.sum()), bool))
    bridged, use = bridge_holes(Log(time[kept], signals), every)
    run = recording(bridged, use=use)
    found = noise_directions(run, nominal.values(), 0.0)
    assert found is not None
    residual = run.residual(nominal.values(), 0.0)
    assert np.abs(residual).max() > 50.0
    left = found.whiten(residual)
    assert np.mean(left[left != 0.0] ** 2) < 1.1
    counted = ((left != 0.0) | (residual == 0.0)).all(axis=0)
    assert counted[bridged.time < 12.1].all()
    assert counted[bridged.time > 14.0].mean() > 0.9


def test_what_jitter_hides_of_a_short_ramp_is_noise(nominal: ParameterSet) -> None:
    """A ramp of 625 rad/s^2 has seven rows: they tell no line, and 1 ms is 0.6 rad/s of it.

    The long ramp tells the jitter, which the short ones need.
    """
    corners = [(0.0, 0.0), (1.0, 0.0), (5.0, 300.0)]
    for begin in range(6, 16, 2):
        ramps = ((0.0, 300.0), (0.08, 350.0), (1.0, 350.0), (1.08, 300.0))
        corners += [(begin + after, speed) for after, speed in ramps]
    fine = np.linspace(0.0, 17.0, 17001)
    asked = np.interp(fine, *np.transpose(corners))
    exact = simulate(inputs_of(Log(fine, {"speed_reference": asked})), nominal.values())
    time = np.arange(0.0, 16.99, 0.01)
    taken = time + np.random.default_rng(1).uniform(-1.5e-3, 1.5e-3, len(time))
    signals = {name: np.interp(taken, fine, values) for name, values in exact.signals.items()}
    log, jitter = restamp(add_noise(Log(time, signals), 1))
    assert jitter is not None
    run = recording(log)
    found = noise_directions(run, nominal.values(), 0.0)
    assert found is not None
    residual = run.residual(nominal.values(), 0.0)
    near = (log.time > 6.0) & (np.mod(log.time, 1.0) < 0.3)
    left = found.whiten(residual)
    current = run.channels.index("armature_current")
    assert np.mean(residual[current, near] ** 2) > 5.0
    assert np.mean(left[current, near] ** 2) < 1.5


@pytest.mark.slow
def test_drum_inertia_of_a_noisy_log_lies_within_its_standard_error(
    true_log: Log, nominal: ParameterSet
) -> None:
    """With the sensors' noise alone it is 21 standard errors off."""
    answer = identify([recording(add_noise(true_log, 4000))], nominal, ["drum_inertia"])
    (inertia,) = answer.parameters
    assert abs(inertia.value - 312.69) < 3.5 * inertia.standard_error


@pytest.mark.slow
def test_window_whose_simulation_does_not_settle_tells_nothing(
    measured: Recording, nominal: ParameterSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, settled, calls = (
        noise_directions(measured, nominal.values(), GAP),
        Recording.strict_residual,
        count(),
    )

    def unsettled(self: Recording, *values: Any) -> Any:
        if next(calls) == 5:
            raise UnsettledError("does not settle")
        return settled(self, *values)

    monkeypatch.setattr(Recording, "strict_residual", unsettled)
    found = noise_directions(measured, nominal.values(), GAP)
    assert plain is not None
    assert found is not None
    np.testing.assert_allclose(found.deviations, plain.deviations, rtol=0.05)


def test_long_log_needs_no_more_simulations_than_a_short_one(
    true_log: Log, nominal: ParameterSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    """60 windows of 0.25 s in 15 s, and the run itself; 30 s alone hold 120 windows."""
    settled, calls = Recording.strict_residual, count()

    def counting(self: Recording, *values: Any) -> Any:
        next(calls)
        return settled(self, *values)

    monkeypatch.setattr(Recording, "strict_residual", counting)
    assert noise_directions(recording(add_noise(true_log, 1)), nominal.values(), GAP) is not None
    assert next(calls) == 61


def test_run_that_cannot_be_simulated_has_no_directions(
    measured: Recording, nominal: ParameterSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unsettled(self: Recording, *values: Any) -> Any:
        raise UnsettledError("does not settle")

    monkeypatch.setattr(Recording, "strict_residual", unsettled)
    assert noise_directions(measured, nominal.values(), GAP) is None
