"""The drive smooths its speed reference with a filter of second order.

    T^2 omega_r'' + 2 zeta T omega_r' + omega_r = reference

Source: W. Leonhard, Control of Electrical Drives, chapter on the cascade control of drives
(smoothing of the reference); K. Ogata, Modern Control Engineering, on second-order systems. A large
damping zeta makes it a filter of first order with the time constant 2 zeta T. T = 0: no filter.
zeta = 1 does not overshoot. At zeta = 1 / sqrt(2) a filter is a dead time up to the second order.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter, Memory

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
PARAMETERS = {
    "time_constant": EffectParameter(
        neutral=0.0, lower=0.0, upper=1.0, plausible=0.03, unit="s", meaning="T"
    ),
    "damping": EffectParameter(
        neutral=1.0, lower=0.3, upper=20.0, plausible=1.0, unit="1", meaning="zeta", std=0.3
    ),
}


def start(p: Record) -> float:
    """The bench starts at rest: reference [rad/s] and its slope [rad/s^2] are zero."""
    return 0.0


def advance(base: float, a: float, s: Record, p: Record) -> float:
    """Filtered reference at the end of an implicit stage of size a [rad/s]."""
    return base + a * s.reference_filter_slope


def advance_slope(base: float, a: float, value: float, s: Record, p: Record) -> float:
    """Slope of the filtered reference [rad/s^2]; it runs after `advance` and recovers its base."""
    t = p.reference_filter_time_constant
    if t == 0.0:
        return base
    reference = s.reference_filter_reference - a * s.reference_filter_slope
    damped = 2.0 * p.reference_filter_damping * t * a
    return (t * t * base + a * (value - reference)) / (t * t + damped + a * a)


MEMORIES = {
    "reference": Memory(start, advance),
    "slope": Memory(start, advance_slope, follows="reference"),
}


def reference(value: float, s: Record, p: Record) -> float:
    """Reference behind the filter [rad/s]."""
    if p.reference_filter_time_constant == 0.0:
        return value
    return s.reference_filter_reference
