"""The drive's limited integrators do not stop but slow down, because each has its own soft bound.

    integrated share of the error = k / (1 + |e_s| / e_0)        e_s: integral of the speed error

Source: K. J. Astrom, T. Hagglund, PID Controllers: Theory, Design, and Tuning, chapter on
integrator windup (bounds of the integral part). k = 0: conditional integration.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
PARAMETERS = {
    "share": EffectParameter(
        neutral=0.0, lower=0.0, upper=1.0, plausible=1.0, unit="1", meaning="k"
    ),
    "bound": EffectParameter(
        neutral=100.0, lower=1.0, upper=1e4, plausible=100.0, unit="rad", meaning="e_0"
    ),
}


def integration_at_limit(value: float, s: Record, p: Record) -> float:
    """Share of its error that a limited integrator integrates [1]."""
    if p.fading_windup_share == 0.0:
        return value
    full = abs(s.speed_integral) / p.fading_windup_bound
    return value + (1.0 - value) * p.fading_windup_share / (1.0 + full)
