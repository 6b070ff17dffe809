"""The report of a replay: lines for the operator, a table, a picture.

It compares two setpoints of the motor speed. matplotlib is imported only when a picture is drawn.
"""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gateway.offline.comparison import SetpointComparison
from gateway.offline.recording_replay import Difference
from register_maps.units import RPM

GREY, BLUE, RED = "#999999", "#0072B2", "#D55E00"


def describe_differences(path: Path, differences: Sequence[Difference], ticks: int) -> str:
    """Line that says how many ticks of a recording came out differently, and the first of them."""
    if not differences:
        return f"{path}: {ticks} ticks, equal bit for bit"
    first = differences[0]
    return (
        f"{path}: {len(differences)} of {ticks} ticks differ, the first is tick {first.tick} at "
        f"{first.time:.3f} s: {first.what} recorded {first.recorded}, replayed {first.replayed}"
    )


def describe_comparison(comparison: SetpointComparison) -> str:
    """Lines that say how far two setpoints are apart, in rpm."""
    error, close = comparison.error, comparison.agreement()
    if not len(error):
        state = comparison.states[-1]
        return f"{comparison.title}: the replay asks for no speed (last state {state})"
    worst = int(np.argmax(np.abs(error)))
    when = comparison.time[comparison.both][worst]
    val = f"; Val1 {close.val1:.2f}, Val2 {close.val2:.2f}" if close else ""
    return (
        f"{comparison.title}: {len(error)} of {len(comparison.time)} samples compared\n"
        f"difference rms {np.sqrt(np.mean(error**2)) / RPM:.3f} rpm, "
        f"max {abs(error[worst]) / RPM:.3f} rpm at {when:.2f} s{val}"
    )


def write_csv(path: Path, comparison: SetpointComparison) -> None:
    """Write both setpoints sample by sample; a value that does not exist stays empty."""
    columns = {
        "time_s": comparison.time,
        "wanted_motor_speed_rad_s": comparison.wanted,
        "setpoint_motor_speed_rad_s": comparison.found,
        "demand_motor_speed_rad_s": comparison.demand,
    }
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*columns, "state", "reason"])
        numbers = zip(*(values.tolist() for values in columns.values()), strict=True)
        for row, state, reason in zip(numbers, comparison.states, comparison.reasons, strict=True):
            writer.writerow([*("" if np.isnan(one) else one for one in row), state, reason])


def draw(path: Path, comparison: SetpointComparison) -> None:
    """Draw both setpoints and their difference."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 6.0), layout="constrained", facecolor="white")
    speed, error = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1.2])
    speed.set_title(comparison.title, loc="left")
    speed.plot(comparison.time, comparison.wanted / RPM, color=GREY, linewidth=3.5, label="then")
    speed.plot(comparison.time, comparison.found / RPM, color=BLUE, linewidth=1.3, label="replay")
    speed.set_ylabel("motor setpoint [rpm]")
    speed.legend(frameon=False)
    apart = (comparison.wanted - comparison.found) / RPM
    error.plot(comparison.time, apart, color=RED, linewidth=0.9)
    error.set_ylabel("then - replay [rpm]")
    error.set_xlabel("time [s]")
    for axes in (speed, error):
        axes.grid(color="#e6e6e6", linewidth=0.6)
        axes.margins(x=0.0)
    figure.savefig(path, dpi=130, format=path.suffix.removeprefix(".") or "png")
