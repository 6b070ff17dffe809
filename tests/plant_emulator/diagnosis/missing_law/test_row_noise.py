"""Rows are white in the noise that they show, whatever the sensors declare."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from plant_emulator.diagnosis.fitting.joint_fit import fit_null
from plant_emulator.diagnosis.localisation.block_regression import BlockRegression
from plant_emulator.diagnosis.localisation.parity_relations import GEAR
from plant_emulator.diagnosis.machines.bench import BenchModel
from plant_emulator.diagnosis.missing_law.law_search import search
from plant_emulator.diagnosis.missing_law.quantities import quantities
from plant_emulator.diagnosis.missing_law.reduced import law_rows
from plant_emulator.diagnosis.missing_law.row_noise import row_noise
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Array, Log


def with_correlated_torque(log: Log, seed: int) -> Log:
    """The log with more noise of the torque sensor: 2 N m, correlated over 30 ms."""
    pole = np.exp(-0.01 / 0.03)
    white = np.random.default_rng(seed).normal(size=len(log.time))
    more = lfilter([2.0 * np.sqrt(1.0 - pole**2)], [1.0, -pole], white)
    return replace(log, signals={**log.signals, "shaft_torque": log["shaft_torque"] + more})


def correlation(rows: Array) -> float:
    """Correlation of neighbours in the gear's relation."""
    own = rows[: len(rows) // 4 * 3].reshape(-1, 3)[:, GEAR]
    return float(np.corrcoef(own[1:], own[:-1])[0, 1])


def test_correlated_noise_of_a_sensor_leaves_white_rows(
    bench_log: Callable[[str], Log], nominal: ParameterSet
) -> None:
    logs = [bench_log(f"bench_practice/practice_004/program{k}") for k in (1, 2)]
    recordings = [recording(with_correlated_torque(log, k)) for k, log in enumerate(logs)]
    null = fit_null(BenchModel(recordings, nominal, {}), range(2))
    regression = BlockRegression(recordings, nominal, null)
    gear = quantities(regression)[0]
    rows = law_rows(regression, gear)
    rest = search(rows, gear, rows.null_loss()).left([0])
    noise = row_noise(regression, rest)
    for k, left in enumerate(rest):
        white = noise.white(k, left[:, None])[:, 0]
        assert abs(correlation(left)) > 0.1
        assert abs(correlation(white)) < 0.05
        assert float(np.mean(white**2)) - 1.0 < 0.1
