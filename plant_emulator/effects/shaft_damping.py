"""The shaft between motor and gear has damping, from its material and its couplings.

    T_mg = k_mg q + d (omega_m - xi omega_g)

Source: W. Leonhard, Control of Electrical Drives, chapter on drives with elastic coupling. d = 0 is
the undamped spring of the nominal bench.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import EffectParameter

if TYPE_CHECKING:
    from plant_emulator.model.records import Record

SUBSYSTEM = "motor_shaft"
NEEDS = "torque sampled at some kHz: the shaft rings far above the log"
PARAMETERS = {
    "damping": EffectParameter(
        neutral=0.0, lower=0.0, upper=1e3, plausible=10.0, unit="N m s/rad", meaning="d"
    ),
}


def motor_shaft_damping(value: float, s: Record, p: Record) -> float:
    """Damping of the shaft [N m s/rad], motor side."""
    return value + p.shaft_damping_damping
