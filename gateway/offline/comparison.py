"""Two setpoints of the motor speed over time: the setpoint of the run and that of its replay."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gateway.arrays import Array
from gateway.cycle.cycle import Output
from gateway.cycle.record import number
from gateway.offline.evaluation import Agreement, agreement


@dataclass(frozen=True, kw_only=True)
class SetpointComparison:
    """Two setpoints of the motor speed, one value a tick; NaN: no setpoint. Shape (n,) each.

    title : which two setpoints these are
    time : since the start of the run [s]
    wanted : setpoint of the run [rad/s]: the recorded setpoint, or the reference in a log
    found : setpoint of the replay [rad/s]
    demand : motor speed that the replay's regulator wants, before the limits [rad/s]
    states, reasons : names of the supervisor's state and reason in the replay
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
        """Ticks that have both setpoints, shape (n,)."""
        there: NDArray[np.bool_] = np.isfinite(self.wanted) & np.isfinite(self.found)
        return there

    @property
    def error(self) -> Array:
        """Setpoint of the run minus that of the replay, where both exist [rad/s]."""
        difference: Array = (self.wanted - self.found)[self.both]
        return difference

    def agreement(self) -> Agreement | None:
        """Val1 and Val2 of the two setpoints; None where the setpoint of the run does not move."""
        wanted = self.wanted[self.both]
        if not len(wanted) or np.ptp(wanted) == 0.0:
            return None
        return agreement(wanted, self.found[self.both])


def compare(
    title: str, time: Array, wanted: Array, outputs: Sequence[Output]
) -> SetpointComparison:
    """Compare the setpoints of a run with the outputs of its replay, tick by tick.

    time [s], wanted [rad/s] : of the run, shape (ticks,)
    """
    return SetpointComparison(
        title=title,
        time=np.asarray(time, dtype=float),
        wanted=np.asarray(wanted, dtype=float),
        found=np.array([_speed_setpoint(one) for one in outputs]),
        demand=np.array([number(one.demand) for one in outputs]),
        states=[one.state.name for one in outputs],
        reasons=["" if one.reason is None else one.reason.name for one in outputs],
    )


def _speed_setpoint(output: Output) -> float:
    return number(None if output.setpoint is None else output.setpoint.speed_setpoint)
