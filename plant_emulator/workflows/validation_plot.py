"""Plot of measured and simulated signals. Only a call of a function imports matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from plant_emulator.errors import report_unwritable
from plant_emulator.signals.log import COMPARED, VOLTAGE, Log, compared_channels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

LABELS = {
    "motor_speed": "motor speed [rad/s]",
    "drum_speed": "drum speed [rad/s]",
    "armature_current": "armature current [A]",
    "shaft_torque": "shaft torque [N m]",
    "armature_voltage": "armature voltage [V]",
}
# Colours of Okabe and Ito, which all kinds of colour vision distinguish.
MEASURED, SIMULATED, RESIDUAL = "#000000", "#0072B2", "#D55E00"


def draw_validation(pairs: Sequence[tuple[Log, Log]], path: str | Path) -> None:
    """Plot each log and its simulation, with the residuals below, one column per log, to a file.

    pairs : (measured, simulated)
    """
    from matplotlib.figure import Figure

    shown = {name for log, _ in pairs for name in compared_channels(log)}
    names = [name for name in (*COMPARED, VOLTAGE) if name in shown]
    figure = Figure(figsize=(7.0 * len(pairs), 3.2 * len(names)), layout="constrained")
    axes = figure.subplots(
        2 * len(names),
        len(pairs),
        squeeze=False,
        sharex="col",
        height_ratios=[3, 1] * len(names),
    )
    for column, (log, simulation) in enumerate(pairs):
        axes[0][column].set_title(log.source)
        for row, name in enumerate(names):
            if name in compared_channels(log):
                _draw(axes[2 * row][column], axes[2 * row + 1][column], log, simulation, name)
            else:
                axes[2 * row][column].set_visible(False)
                axes[2 * row + 1][column].set_visible(False)
        last = [axis for axis in axes[:, column] if axis.get_visible()][-1]
        last.set_xlabel("time [s]")
        last.tick_params(labelbottom=True)
    axes[0][0].legend(loc="upper right")
    with report_unwritable(path):
        figure.savefig(path, dpi=120, format=Path(path).suffix.removeprefix(".") or "png")


def _draw(upper: Axes, lower: Axes, log: Log, simulation: Log, name: str) -> None:
    upper.plot(log.time, log[name], color=MEASURED, linewidth=1.6, label="measured")
    upper.plot(log.time, simulation[name], color=SIMULATED, linewidth=0.9, label="simulated")
    upper.set_ylabel(LABELS[name])
    lower.plot(log.time, log[name] - simulation[name], color=RESIDUAL, linewidth=0.7)
    lower.axhline(0.0, color="#999999", linewidth=0.5)
    lower.set_ylabel("residual")
