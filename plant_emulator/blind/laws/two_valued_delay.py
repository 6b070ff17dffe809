"""The dead time of the reference jumps between two values from scan to scan.

    b_k = b + A / sqrt(3) or b - A / sqrt(3)

A fieldbus telegram just misses a scan of length T_s, or it does not. Source: J. Nilsson, Real-Time
Control Systems with Delays, thesis, Lund 1998 (delays that jump between a few values). The scan's
number k decides: b_k is the long value if the fractional part of k^2 times the golden ratio is less
than 0.5. The standard deviation is that of a uniform distribution over b - A .. b + A. A = 0: the
constant dead time.
"""

from __future__ import annotations

from math import floor, sqrt
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
PARAMETERS = {
    "amplitude": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.05, plausible=0.005, unit="s", meaning="A"
    ),
    "scan_period": EffectParameter(
        neutral=0.01, lower=0.001, upper=0.1, plausible=0.01, unit="s", meaning="T_s"
    ),
}

GOLDEN = 0.6180339887498949


def dead_time(value: float, s: Record, p: Record) -> float:
    """Dead time in the current scan [s]."""
    amplitude = p.two_valued_delay_amplitude
    if amplitude == 0.0:
        return value
    scan = floor(s.time / p.two_valued_delay_scan_period + 1e-6)
    turns = GOLDEN * scan * scan
    drawn = turns - floor(turns)
    jump = amplitude / sqrt(3.0)
    return max(0.0, value + (jump if drawn < 0.5 else -jump))
