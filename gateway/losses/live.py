"""A sweep of steady speeds as a run of the daemon: its configuration, and its end (pure)."""

from collections.abc import Sequence
from typing import Final

from gateway.configuration import sweep_speeds
from gateway.configuration.config import Config, from_document
from gateway.configuration.sweep_speeds import HOLD_S, RATE_RPM_S, Sweep
from gateway.cycle.cycle import Output
from gateway.cycle.supervisor import State
from gateway.errors import ConfigError
from gateway.losses.fit import FEWEST, SPREAD, count_speeds
from register_maps.units import RPM

ENDED: Final = (State.RAMPDOWN, State.SAFE)
BEGUN: Final = 0.5
"""Share of the first speed that shows that the sweep has begun; before, the bench only stood."""


def sweep_config(config: Config, speeds: Sequence[float] | None, hold: float | None) -> Config:
    """Configuration with a sweep. Raises ConfigError for speeds that do not suit the fit.

    speeds : [rpm], None: the default speeds up to the limit; hold : [s], None: the default
    """
    highest = config.limits.speed_max / RPM
    usual = [one for one in sweep_speeds.DEFAULT if one <= highest * (1.0 + 1e-9)]
    asked = usual if speeds is None else list(speeds)
    table = {
        "speeds_rpm": asked,
        "hold_s": HOLD_S if hold is None else hold,
        "rate_rpm_s": RATE_RPM_S,
    }
    swept = from_document({**config.document, "sweep": table})
    _refuse(asked, highest)
    return swept


def _refuse(speeds: Sequence[float], highest: float) -> None:
    """Refuse speeds that cannot determine the law, before anything turns."""
    ordered = sorted(speeds)
    if count_speeds(speeds) < FEWEST or ordered[-1] < SPREAD * ordered[0]:
        raise ConfigError(
            "speeds that do not determine the friction",
            place="--speeds",
            value=ordered,
            expected=f"at least {FEWEST}, the fastest at least {SPREAD:g} times the slowest",
        )
    if ordered[-1] > highest * (1.0 + 1e-9):
        raise ConfigError(
            "faster than the limit",
            place="--speeds",
            value=ordered[-1],
            expected=f"at most limits.speed_max_rpm = {highest:.0f}",
        )


class Progress:
    """Progress of a sweep; called with the output of every tick.

    done : the sweep was completed
    """

    def __init__(self, sweep: Sweep) -> None:
        self._first = BEGUN * sweep.speeds[0]
        self._begun = self.done = False

    def __call__(self, output: Output) -> bool:
        """Whether the run is over: the sweep is at standstill again, or the run has ended early."""
        if output.state in ENDED:
            return True
        if output.state is State.RUN and output.demand is not None:
            self._begun = self._begun or output.demand > self._first
            self.done = self._begun and output.demand == 0.0
        return self.done
