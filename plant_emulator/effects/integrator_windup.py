"""The drive's integrators go on while their output is limited.

    d(integral)/dt = k error while the output is at its limit and the error leads further outwards

Source: K. J. Astrom, T. Hagglund, PID Controllers: Theory, Design, and Tuning, chapter on
integrator windup. k = 0 is conditional integration, as in the nominal drive. k = 1 is no measure
against windup.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "drive"
NEEDS = "a run that drives the current or the voltage into its limit for some time"
PARAMETERS = {
    "share": EffectParameter(
        neutral=0.0, lower=0.0, upper=1.0, plausible=1.0, unit="1", meaning="k"
    ),
}


def integration_at_limit(value: float, s: Record, p: Record) -> float:
    """Share of its error that an integrator at its limit takes in [1]."""
    return value + (1.0 - value) * p.integrator_windup_share
