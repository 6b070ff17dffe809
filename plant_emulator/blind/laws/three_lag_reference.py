"""The drive smooths its speed reference with three equal lags in series.

    (T_3 d/dt + 1)^3 omega_r = reference

Source: K. Ogata, Modern Control Engineering, on systems of higher order with real poles.
T_3 = 0: no filter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
PARAMETERS = {
    "lag": EffectParameter(
        neutral=0.0, lower=0.0, upper=1.0, plausible=0.014, unit="s", meaning="T_3"
    ),
}


def start(p: Record) -> float:
    """Output of a lag at the start of a run: 0, because the bench is at rest [rad/s]."""
    return 0.0


def advance(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Output of the first lag at the end of an implicit stage of size a [rad/s]."""
    lag = p.three_lag_reference_lag
    return base if lag == 0.0 else value + (base - value) * (lag / (lag + a))


def advance_second(base: float, a: float, s: Record, p: Record) -> float:
    """Output of the second lag at the end of an implicit stage of size a [rad/s]."""
    lag, value = p.three_lag_reference_lag, s.three_lag_reference_first
    return base if lag == 0.0 else value + (base - value) * (lag / (lag + a))


def advance_third(base: float, a: float, s: Record, p: Record) -> float:
    """Output of the third lag at the end of an implicit stage of size a [rad/s]."""
    lag, value = p.three_lag_reference_lag, s.three_lag_reference_second
    return base if lag == 0.0 else value + (base - value) * (lag / (lag + a))


MEMORIES = {
    "first": Memory(start, advance, follows="reference"),
    "second": Memory(start, advance_second),
    "third": Memory(start, advance_third),
}


def reference(value: float, s: Record, p: Record) -> float:
    """Filtered reference [rad/s]."""
    return value if p.three_lag_reference_lag == 0.0 else s.three_lag_reference_third
