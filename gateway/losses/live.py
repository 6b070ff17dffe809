"""The configuration of a sweep of steady speeds (pure)."""

from collections.abc import Sequence

from gateway.configuration import sweep_speeds
from gateway.configuration.config import Config, from_document
from gateway.configuration.sweep_speeds import HOLD_S, RATE_RPM_S
from gateway.errors import ConfigError
from gateway.losses.fit import FEWEST_SECTIONS, SPREAD, count_speeds
from register_maps.units import RPM


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
    if count_speeds(speeds) < FEWEST_SECTIONS or ordered[-1] < SPREAD * ordered[0]:
        raise ConfigError(
            "speeds that do not determine the friction",
            place="--speeds",
            value=ordered,
            expected=f"at least {FEWEST_SECTIONS}, "
            f"the fastest at least {SPREAD:g} times the slowest",
        )
    if ordered[-1] > highest * (1.0 + 1e-9):
        raise ConfigError(
            "faster than the limit",
            place="--speeds",
            value=ordered[-1],
            expected=f"at most limits.speed_max_rpm = {highest:.0f}",
        )
