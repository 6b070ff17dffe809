"""Regulators: from the window since the last sample to the demanded motor speed.

A regulator is one module of this folder, found by its file name. It has `Params` (frozen, with a
classmethod `of(config)`), `State` (frozen) and three functions:

    seed(params, motor_speed, drum_speed) -> State      its demand is the measured motor speed
    update(params, state, window) -> (State, Demand)    one new sample
    follow(params, state, demand, setpoint) -> State    the limits did not pass the demand

All are pure. `test_every_regulator.py` tests every module of this folder.
"""

from functools import lru_cache
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, Protocol, cast

from gateway.errors import ConfigError

if TYPE_CHECKING:
    from gateway.configuration.config import Config
    from gateway.physics.window import Window
    from gateway.regulators.demand import Demand


class _Params(Protocol):
    def of(self, config: "Config") -> Any:
        """Parameters out of the configuration."""


class Regulator(Protocol):
    """A module of this package."""

    Params: _Params

    def seed(self, params: Any, motor_speed: float, drum_speed: float) -> Any:
        """State whose demand is the measured motor speed."""

    def update(self, params: Any, state: Any, window: "Window") -> "tuple[Any, Demand]":
        """State and demand after one new sample."""

    def follow(self, params: Any, state: Any, demand: float, setpoint: float) -> Any:
        """State after the limits passed `setpoint` instead of `demand` [rad/s]."""


def names() -> tuple[str, ...]:
    """Names of all regulators, sorted."""
    return tuple(sorted(found.name for found in iter_modules(__path__) if found.name != "demand"))


def unknown_error(name: str, place: str) -> ConfigError:
    """Return the error for a name that no regulator has; `place` says where the name stands."""
    return ConfigError("unknown regulator", place=place, value=name, expected=" or ".join(names()))


@lru_cache
def load(name: str) -> Regulator:
    """Import the regulator of this name; a repeated call does not read the folder again.

    Raises ConfigError where there is none.
    """
    if name not in names():
        raise unknown_error(name, "regulator.name")
    return cast("Regulator", import_module(f"{__name__}.{name}"))
