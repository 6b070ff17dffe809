"""Two equal lags in series filter the measured drum speed.

    (tau/2 d/dt + 1)^2 omega_meas = omega_d

Source: K. Ogata, Modern Control Engineering, on critically damped second-order systems. tau: delay
of a slow change. tau = 0: no filter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "speed_sensor"
PARAMETERS = {
    "time_constant": EffectParameter(
        neutral=0.0, lower=0.0, upper=1.0, plausible=0.05, unit="s", meaning="tau"
    ),
}


def start(p: Record) -> float:
    """Output of a lag at the start of a run: 0, because the bench is at rest [rad/s]."""
    return 0.0


def advance(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Output of the first lag at the end of an implicit stage of size a [rad/s]."""
    lag = 0.5 * p.two_lag_drum_speed_time_constant
    return base if lag == 0.0 else value + (base - value) * (lag / (lag + a))


def advance_second(base: float, a: float, s: Record, p: Record) -> float:
    """Output of the second lag at the end of an implicit stage of size a [rad/s]."""
    lag, value = 0.5 * p.two_lag_drum_speed_time_constant, s.two_lag_drum_speed_first
    return base if lag == 0.0 else value + (base - value) * (lag / (lag + a))


MEMORIES = {
    "first": Memory(start, advance, follows="measured_drum_speed"),
    "second": Memory(start, advance_second),
}


def measured_drum_speed(value: float, s: Record, p: Record) -> float:
    """Measured drum speed [rad/s]."""
    return value if p.two_lag_drum_speed_time_constant == 0.0 else s.two_lag_drum_speed_second
