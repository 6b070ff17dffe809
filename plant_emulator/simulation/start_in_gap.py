"""Where in the backlash gap a logged run starts: the fit of that one number to its log."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.signals.log import COMPARED
from plant_emulator.simulation.sensor_noise import SENSORS
from plant_emulator.simulation.simulate import simulate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.signals.log import Log
    from plant_emulator.simulation.run_inputs import RunInputs

# Tolerance of the simulations, which are compared over a whole run.
SCAN_TOLERANCE = 1e-3


def mean_square_residual(measured: Log, simulated: Log) -> float:
    """Mean square of the residual in units of the sensors' noise [1].

    The mean is over the compared channels except the voltage, whose sensor may have an offset.
    """
    squares = [
        np.mean(((measured[name] - simulated[name]) / SENSORS[name][0]) ** 2)
        for name in COMPARED
        if name in measured
    ]
    return float(np.mean(squares))


def fit_start(log: Log, run: RunInputs, values: Mapping[str, float], points: int = 41) -> float:
    """Fit the gap position at the start of a run to its log, -1 to 1 [1].

    The cost has many local minima, because the gap position decides when the first contact comes.
    Therefore a scan over `points` positions finds the best basin, and a bounded search its minimum.
    """
    from scipy.optimize import minimize_scalar

    def cost(position: float) -> float:
        return mean_square_residual(
            log, simulate(run, values, gap_position=position, tolerance=SCAN_TOLERANCE)
        )

    grid = np.linspace(-1.0, 1.0, points)
    best = float(grid[np.argmin([cost(float(position)) for position in grid])])
    width = float(grid[1] - grid[0])
    bounds = (max(-1.0, best - width), min(1.0, best + width))
    found = minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-4})
    return float(found.x) if found.fun < cost(best) else best
