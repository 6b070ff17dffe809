"""A coarse converter quantises the speed reference of the drive.

    omega_r = q round(reference / q)

Source: B. Widrow, I. Kollar, Quantization Noise (2008), the uniform quantiser. q = 0: no
quantisation.
"""

from __future__ import annotations

from math import floor
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
PARAMETERS = {
    "step": EffectParameter(
        neutral=0.0, lower=0.0, upper=20.0, plausible=1.5, unit="rad/s", meaning="q"
    ),
}


def reference(value: float, s: Record, p: Record) -> float:
    """Quantised reference [rad/s]."""
    step = p.coarse_reference_step
    return value if step == 0.0 else step * floor(value / step + 0.5)
