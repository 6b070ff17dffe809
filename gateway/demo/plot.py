"""The picture of a demo with one column a truck: does the drum feel like the road?

matplotlib is imported only when a picture is drawn.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gateway.arrays import Array
from register_maps.units import KMH, RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Colours of Okabe and Ito, distinct for every kind of colour vision.
ROAD, BENCH, ASKED, WARM = "#999999", "#0072B2", "#E69F00", "#D55E00"


@dataclass(frozen=True, kw_only=True)
class Curves:
    """Curves of one run in SI, shape (n,) each; time : since the start of the cycle [s]."""

    title: str
    note: str
    time: Array
    road_speed: Array
    bench_speed: Array
    wheel_force: Array
    road_load: Array
    shaft_torque: Array
    motor_setpoint: Array
    motor_speed: Array


def draw(runs: Sequence[Curves], path: Path) -> None:
    """Draw the runs side by side and write the picture."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.4 * len(runs), 10.0), layout="constrained", facecolor="white")
    axes = figure.subplots(
        4, len(runs), squeeze=False, sharex=True, sharey="row", height_ratios=[3.2, 1.2, 2, 2]
    )
    for column, curves in enumerate(runs):
        _speed(axes[0][column], curves)
        _error(axes[1][column], curves)
        _force(axes[2][column], curves)
        _motor(axes[3][column], curves)
    for row in axes:
        for one in row:
            one.grid(color="#e6e6e6", linewidth=0.6)
            one.spines[["top", "right"]].set_visible(False)
            one.margins(x=0.0)
            one.label_outer()
    figure.savefig(path, dpi=130)


def _speed(axes: "Axes", curves: Curves) -> None:
    axes.set_title(curves.title, loc="left", fontsize=13, fontweight="bold")
    axes.text(0.5, 0.06, curves.note, transform=axes.transAxes, ha="center", fontsize=10)
    axes.plot(curves.time, curves.road_speed / KMH, color=ROAD, linewidth=4.5, label="road")
    axes.plot(curves.time, curves.bench_speed / KMH, color=BENCH, linewidth=1.4, label="bench")
    axes.set_ylabel("speed [km/h]")
    axes.legend(loc="upper right", frameon=False)


def _error(axes: "Axes", curves: Curves) -> None:
    error = (curves.bench_speed - curves.road_speed) / KMH
    axes.fill_between(curves.time, error, color=WARM, alpha=0.75, linewidth=0.0)
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set_ylabel("bench - road\n[km/h]")


def _force(axes: "Axes", curves: Curves) -> None:
    axes.plot(curves.time, curves.road_load, color=ROAD, linewidth=3.0, label="road load")
    axes.plot(curves.time, curves.wheel_force, color=BENCH, linewidth=1.2, label="truck's force")
    axes.set_ylabel("force at the wheel [N]")
    axes.legend(loc="upper right", frameon=False)


def _motor(axes: "Axes", curves: Curves) -> None:
    axes.plot(curves.time, curves.shaft_torque, color=WARM, linewidth=1.0, label="shaft torque")
    axes.set_ylabel("shaft torque [Nm]", color=WARM)
    axes.set_xlabel("time [s]")
    speeds = axes.twinx()
    speeds.plot(curves.time, curves.motor_setpoint / RPM, color=ASKED, linewidth=2.4)
    speeds.plot(curves.time, curves.motor_speed / RPM, color="black", linewidth=0.8)
    speeds.set_ylabel("motor speed [rpm]\norange: asked, black: measured", fontsize=9)
    speeds.spines["top"].set_visible(False)
