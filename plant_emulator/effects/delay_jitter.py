"""The dead time of the reference varies from scan to scan.

    b_k = b + A u_k,   u_k in [-1, 1], evenly spread, one for each scan of length T_s

Source: J. Nilsson, Real-Time Control Systems with Delays, thesis, Lund 1998 (random delays in loops
closed over a network). u_k is computed from the scan's number and `sequence`, so that a run can be
repeated. A real drive has another sequence: its log shows A by the spread of the dead times.
"""

from __future__ import annotations

from math import floor
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
NEEDS = "the sequence of dead times: a drive's own cannot be reproduced, only its spread shows"
PARAMETERS = {
    "amplitude": EffectParameter(
        neutral=0.0, lower=0.0, upper=0.05, plausible=0.005, unit="s", meaning="A"
    ),
    "scan_period": EffectParameter(
        neutral=0.01, lower=0.001, upper=0.1, plausible=0.01, unit="s", meaning="T_s", std=0.0025
    ),
    "sequence": EffectParameter(
        neutral=0.0,
        lower=0.0,
        upper=1000.0,
        plausible=0.0,
        unit="1",
        meaning="which sequence",
        per_run=True,
    ),
}


def even(number: float) -> float:
    """Pseudo-random number in [0, 1): late digits of a polynomial in the argument."""
    drawn = 0.7548776662 * number + 0.3
    for _ in range(3):
        drawn = drawn - floor(drawn)
        drawn = (drawn + 17.13) * (drawn + 0.61) * 971.7
    return drawn - floor(drawn)


def dead_time(value: float, s: Record, p: Record) -> float:
    """Dead time in the present scan [s]."""
    amplitude = p.delay_jitter_amplitude
    if amplitude == 0.0:
        return value
    # 1e-6: a scan begins at its time, also where rounding puts the time just below.
    scan = floor(s.time / p.delay_jitter_scan_period + 1e-6)
    drawn = 2.0 * even(scan + 1e4 * p.delay_jitter_sequence) - 1.0
    return max(0.0, value + amplitude * drawn)
