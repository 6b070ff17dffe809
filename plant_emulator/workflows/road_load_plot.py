"""Plot of a fitted road log: measured and simulated velocity, residual and torque."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from plant_emulator.errors import report_unwritable
from plant_emulator.workflows.validation_plot import MEASURED, RESIDUAL, SIMULATED

if TYPE_CHECKING:
    from plant_emulator.road_load.fit import RoadFit


def plot(fit: RoadFit, path: str | Path) -> None:
    """Plot a fit to a file. The times are those of the velocity's clock."""
    from matplotlib.figure import Figure

    run, values = fit.run, fit.values
    residual = run.residual(values)
    first = run.velocity.start
    since_start = (run.torque.time - first - values.clock_ahead) / (1.0 + values.clock_skew)
    figure = Figure(figsize=(10.0, 8.0), layout="constrained")
    upper, middle, lower = figure.subplots(3, 1, sharex=True, height_ratios=[3, 1, 2])
    upper.plot(run.time, run.measured, color=MEASURED, linewidth=1.6, label="measured")
    upper.plot(run.time, run.measured - residual, color=SIMULATED, linewidth=0.9, label="simulated")
    upper.set_ylabel("velocity [m/s]")
    upper.set_title(f"{run.torque.source}\n{run.velocity.source}", fontsize="medium")
    upper.legend(loc="upper right")
    middle.plot(run.time, residual, color=RESIDUAL, linewidth=0.7)
    middle.axhline(0.0, color="#999999", linewidth=0.5)
    middle.set_ylabel("residual [m/s]")
    lower.plot(first + since_start, run.torque.values, color=MEASURED, linewidth=0.6)
    lower.axhline(values.torque_offset, color="#999999", linewidth=0.5)
    lower.set_ylabel("motor torque [N m]")
    lower.set_xlabel("time of the velocity log [s]")
    with report_unwritable(path):
        figure.savefig(path, dpi=120, format=Path(path).suffix.removeprefix(".") or "png")
