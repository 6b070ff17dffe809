"""What a replay has to say: figures, table, picture. It compares two setpoints of the motor speed.

matplotlib is imported only when a picture is drawn.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gateway.arrays import Array
from gateway.offline.evaluation import Agreement, agreement
from register_maps.units import RPM

GREY, BLUE, RED = "#999999", "#0072B2", "#D55E00"


@dataclass(frozen=True, kw_only=True)
class Compared:
    """Two setpoints of the motor speed over time, SI.

    wanted : what was asked for then: the recorded setpoint or the logged reference, see `title`
    found : what the replay asks for; demand : what its regulator wants, before the limits
    """

    title: str
    time: Array
    wanted: Array
    found: Array
    demand: Array
    states: list[str]
    reasons: list[str]

    @property
    def both(self) -> NDArray[np.bool_]:
        """Where there is something to compare."""
        there: NDArray[np.bool_] = np.isfinite(self.wanted) & np.isfinite(self.found)
        return there

    @property
    def error(self) -> Array:
        """Wanted minus found, where there are both [rad/s]."""
        difference: Array = (self.wanted - self.found)[self.both]
        return difference

    def agreement(self) -> Agreement | None:
        """Val1 and Val2; None where the wanted one does not move."""
        wanted = self.wanted[self.both]
        if not len(wanted) or np.ptp(wanted) == 0.0:
            return None
        return agreement(wanted, self.found[self.both])

    def summary(self) -> str:
        """The comparison in a few lines for the operator."""
        error, close = self.error, self.agreement()
        if not len(error):
            return f"{self.title}: the replay asks for no speed (last state {self.states[-1]})"
        worst = int(np.argmax(np.abs(error)))
        when = self.time[self.both][worst]
        val = f"; Val1 {close.val1:.2f}, Val2 {close.val2:.2f}" if close else ""
        return (
            f"{self.title}: {len(error)} of {len(self.time)} samples compared\n"
            f"difference rms {np.sqrt(np.mean(error**2)) / RPM:.3f} rpm, "
            f"max {abs(error[worst]) / RPM:.3f} rpm at {when:.2f} s{val}"
        )


def write_csv(path: Path, compared: Compared) -> None:
    """Write both setpoints sample by sample; what there is not is left empty."""
    columns = {
        "time_s": compared.time,
        "wanted_motor_speed_rad_s": compared.wanted,
        "setpoint_motor_speed_rad_s": compared.found,
        "demand_motor_speed_rad_s": compared.demand,
    }
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*columns, "state", "reason"])
        numbers = zip(*(values.tolist() for values in columns.values()), strict=True)
        for row, state, reason in zip(numbers, compared.states, compared.reasons, strict=True):
            writer.writerow([*("" if np.isnan(one) else one for one in row), state, reason])


def draw(path: Path, compared: Compared) -> None:
    """Draw both setpoints and their difference."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 6.0), layout="constrained", facecolor="white")
    speed, error = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1.2])
    speed.set_title(compared.title, loc="left")
    speed.plot(compared.time, compared.wanted / RPM, color=GREY, linewidth=3.5, label="then")
    speed.plot(compared.time, compared.found / RPM, color=BLUE, linewidth=1.3, label="replay")
    speed.set_ylabel("motor setpoint [rpm]")
    speed.legend(frameon=False)
    error.plot(compared.time, (compared.wanted - compared.found) / RPM, color=RED, linewidth=0.9)
    error.set_ylabel("then - replay [rpm]")
    error.set_xlabel("time [s]")
    for axes in (speed, error):
        axes.grid(color="#e6e6e6", linewidth=0.6)
        axes.margins(x=0.0)
    figure.savefig(path, dpi=130, format=path.suffix.removeprefix(".") or "png")
