"""Identification from logs whose noise is not white, against known parameters."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.estimation.covariance import data_errors
from plant_emulator.estimation.start_search import StartSearch
from plant_emulator.identification.identify import Identification, fit_from, identify
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.recordings.recording import Recording, recording
from plant_emulator.signals.log import COMPARED, Array, Log
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import SENSORS
from plant_emulator.simulation.simulate import simulate, values_of

FREE = ("drum_inertia", "gear_viscous_friction", "dead_time")
TIME = np.arange(2500) * 0.01
CORNERS = [0, 1, 5, 8, 11, 15, 18, 20, 24, 25], [0, 0, 150, 150, 60, 60, 160, 160, 0, 0]
REFERENCE = {"speed_reference": np.interp(TIME, *CORNERS)}
RUN = inputs_of(Log(TIME, REFERENCE, "made"))

Noise = Callable[[np.random.Generator, str], Array]


def coloured(random: np.random.Generator, _: str) -> Array:
    """Noise of variance 1 that is correlated over 30 ms, of first order."""
    pole, draws = np.exp(-0.01 / 0.03), random.standard_normal(len(TIME))
    found = np.empty(len(TIME))
    found[0] = draws[0]
    for k in range(1, len(TIME)):
        found[k] = pole * found[k - 1] + np.sqrt(1.0 - pole**2) * draws[k]
    return found


def humming(random: np.random.Generator, name: str) -> Array:
    """White noise; on current and torque 1.5 times as much of 50 Hz, and as much of 100 Hz."""
    white = random.standard_normal(len(TIME))
    if name not in {"armature_current", "shaft_torque"}:
        return white
    mains, (first, second) = random.uniform(49.95, 50.05), random.uniform(-np.pi, np.pi, 2)
    turns = 2.0 * np.pi * mains * TIME
    hum = 1.5 * np.cos(turns + first) + np.cos(2.0 * turns + second)
    return np.asarray(white + np.sqrt(2.0) * hum)


def logged(nominal: ParameterSet, noise: Noise, seed: int) -> tuple[dict[str, float], Recording]:
    """Parameters of a bench, and a log of it with this noise."""
    random = np.random.default_rng(seed)
    true = values_of(nominal)
    for name in FREE:
        true[name] += 0.3 * (nominal[name].std or 0.0) * random.standard_normal()
    log = simulate(RUN, true, gap_position=random.uniform(-1.0, 1.0), step=5e-4)
    signals = {name: log[name] + SENSORS[name][0] * noise(random, name) for name in COMPARED}
    return true, recording(replace(log, signals={**REFERENCE, **signals}))


def white_errors(run: Recording, nominal: ParameterSet, found: Identification) -> Array:
    """Values of a fit with white weights, and the relative standard errors that white noise gives.

    Shape (2, parameters).
    """
    search = StartSearch([run], values_of(found.parameter_set), FREE)
    search.gaps = list(found.gap_positions)
    fitted = fit_from([run], nominal, FREE, search)
    count = len(FREE)
    return np.stack([np.exp(fitted.z[:count]), data_errors(fitted.information)[:count]])


@pytest.mark.slow
@pytest.mark.parametrize("noise", [coloured, humming])
def test_intervals_hold_the_truth_where_white_weights_would_not(
    nominal: ParameterSet, noise: Noise
) -> None:
    errors, white = [], []
    for seed in range(20):
        true, run = logged(nominal, noise, seed)
        found = identify([run], nominal, FREE)
        values = np.array([true[name] for name in FREE])
        own = np.array([(p.value, p.standard_error) for p in found.parameters]).T
        errors.append((own[0] - values) / own[1])
        value, error = white_errors(run, nominal, found)
        white.append((value / values - 1.0) / error)
    held, held_by_white = (np.mean(np.abs(np.array(e)) <= 1.96) for e in (errors, white))
    print(f"95 % intervals hold {held:.3f}, those of white weights {held_by_white:.3f}")
    # 60 intervals, not all independent: 0.95 +- 2 * 0.035.
    assert 0.88 <= held <= 1.0
    assert held_by_white < 0.75


def test_spikes_are_left_out(nominal: ParameterSet) -> None:
    """0.5 % of the torque's samples 30 standard deviations off; by hand: 12 of 2500 samples."""
    true, run = logged(nominal, lambda random, _: random.standard_normal(len(TIME)), 3)
    places = np.arange(150, 2500, 200)
    torque = run.log["shaft_torque"].copy()
    torque[places] += 30.0 * SENSORS["shaft_torque"][0]
    spiked = recording(replace(run.log, signals={**run.log.signals, "shaft_torque": torque}))
    found = identify([spiked], nominal, FREE)
    assert found.noise["shaft_torque"].outliers == pytest.approx(len(places) / len(TIME))
    assert found.chi_squared == pytest.approx(1.0, abs=0.05)
    for p in found.parameters:
        assert abs(p.value - true[p.name]) <= 3.0 * p.standard_error, p.name


def test_misfit_does_not_pass_for_noise(nominal: ParameterSet) -> None:
    """A torque sensor that is off by a slow wave: no noise of a sensor follows its past so well."""
    _, run = logged(nominal, lambda random, _: random.standard_normal(len(TIME)), 4)
    wave = 5.0 * SENSORS["shaft_torque"][0] * np.sin(2.0 * np.pi * TIME / 2.0)
    signals = {**run.log.signals, "shaft_torque": run.log["shaft_torque"] + wave}
    found = identify([recording(replace(run.log, signals=signals))], nominal, FREE)
    assert found.noise == {}
    # By hand: 5^2 / 2 more in one channel of four.
    assert found.chi_squared > 3.0
