"""Rows are white in the noise that they show, whatever the sensors declare."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from plant_emulator.diagnosis.fitting.approach import fit_null
from plant_emulator.diagnosis.localisation.block_regression import BlockRegression
from plant_emulator.diagnosis.localisation.parity_relations import GEAR
from plant_emulator.diagnosis.machines.bench import BenchModel
from plant_emulator.diagnosis.missing_law.law_search import search
from plant_emulator.diagnosis.missing_law.quantities import quantities
from plant_emulator.diagnosis.missing_law.reduced import law_rows
from plant_emulator.diagnosis.missing_law.row_noise import RowNoise, row_noise
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Array, Log


def with_correlated_torque(log: Log, seed: int, size: float, time: float) -> Log:
    """The log with more noise of the torque sensor, of this size [N m] and correlation time [s]."""
    pole = np.exp(-0.01 / time)
    white = np.random.default_rng(seed).normal(size=len(log.time))
    more = lfilter([size * np.sqrt(1.0 - pole**2)], [1.0, -pole], white)
    return replace(log, signals={**log.signals, "shaft_torque": log["shaft_torque"] + more})


def correlation(rows: Array) -> float:
    """Correlation of neighbours in the gear's relation."""
    own = rows[: len(rows) // 4 * 3].reshape(-1, 3)[:, GEAR]
    return float(np.corrcoef(own[1:], own[:-1])[0, 1])


def rest_and_noise(
    logs: Sequence[Log], nominal: ParameterSet, size: float, time: float
) -> tuple[list[Array], RowNoise]:
    """What a constant leaves of the rows of runs with correlated torque, and its noise."""
    recordings = [
        recording(with_correlated_torque(log, k, size, time)) for k, log in enumerate(logs)
    ]
    null = fit_null(BenchModel(recordings, nominal, {}), range(2))
    regression = BlockRegression(recordings, nominal, null)
    gear = quantities(regression)[0]
    rows = law_rows(regression, gear)
    rest = search(rows, gear, rows.null_loss()).left([0])
    return rest, row_noise(regression, rest)


@pytest.fixture
def logs(bench_log: Callable[[str], Log]) -> list[Log]:
    """Two runs of the independent bench with white noise, without an effect."""
    return [bench_log(f"bench_practice/practice_004/program{k}") for k in (1, 2)]


def test_correlated_noise_of_a_sensor_leaves_white_rows(
    logs: list[Log], nominal: ParameterSet
) -> None:
    rest, noise = rest_and_noise(logs, nominal, size=2.0, time=0.03)
    for k, left in enumerate(rest):
        white = noise.white(k, left[:, None])[:, 0]
        assert abs(correlation(left)) > 0.1
        assert abs(correlation(white)) < 0.05
        assert float(np.mean(white**2)) - 1.0 < 0.1


def test_a_wander_that_no_sensor_has_stays_a_gap(logs: list[Log], nominal: ParameterSet) -> None:
    rest, noise = rest_and_noise(logs, nominal, size=5.0, time=0.3)
    for k, left in enumerate(rest):
        white = noise.white(k, left[:, None])[:, 0]
        assert float(np.sum(white**2)) > 0.9 * float(np.sum(left**2)) > 3.0 * len(left)
