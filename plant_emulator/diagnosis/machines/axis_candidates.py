"""The effects of an axis as unknowns of a fit, scaled by what the axis's own runs show."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.machine import Candidate, DerivedQuantity
from plant_emulator.diagnosis.machines.axis_effects import Scale
from plant_emulator.estimation.unknowns import Unknown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from plant_emulator.diagnosis.machines.axis_effects import AxisEffect, Constant
    from plant_emulator.diagnosis.machines.axis_signals import AxisRun

OF_UNITS = {
    False: {"force": "N", "speed": "m/s", "sample": "s"},
    True: {"force": "N m", "speed": "rad/s", "sample": "s"},
}
NAMES = ("inertia", "viscous_friction", "coulomb_friction", "offset")
UNITS = {
    False: dict(zip(NAMES, ("kg", "N s/m", "N", "N"), strict=True)),
    True: dict(zip(NAMES, ("kg m^2", "N m s/rad", "N m", "N m"), strict=True)),
}
DIRECTIONS = {"forwards": 1.0, "backwards": -1.0}


def scale_of(runs: Sequence[AxisRun], pitch: float) -> Scale:
    """Scale of the axis that made these runs; pitch : travel of a revolution [m or rad]."""
    low = min(float(r.motion.position.min()) for r in runs)
    high = max(float(r.motion.position.max()) for r in runs)
    return Scale(
        force=float(np.sqrt(np.mean(np.concatenate([r.force for r in runs]) ** 2))),
        speed=max(float(np.abs(r.motion.velocity).max()) for r in runs),
        middle=0.5 * (low + high),
        travel=0.5 * (high - low),
        pitch=pitch,
        sample=max(r.motion.period for r in runs),
    )


def candidate(name: str, effect: AxisEffect, scale: Scale, *, rotary: bool) -> Candidate:
    """Turn the declaration of an effect into unknowns; rotary : whether the axis is rotary."""
    sizes: dict[str, Unknown] = {}
    shapes: dict[str, Unknown] = {}
    for key, constant in effect.constants.items():
        unknown = _unknown(f"{name}_{key}", constant, unit_of(constant, scale))
        (shapes if constant.neutral is None else sizes)[key] = unknown
    return Candidate(
        name=name,
        title=effect.title,
        needs=effect.needs,
        subsystem=effect.subsystem,
        sizes=tuple(sizes.values()),
        shapes=tuple(shapes.values()),
        states=(),
        neutral={u.name: effect.constants[key].neutral or 0.0 for key, u in sizes.items()},
        fixed={},
        units={
            f"{name}_{key}": OF_UNITS[rotary].get(constant.of, constant.unit)
            for key, constant in effect.constants.items()
        },
        derived=tuple(
            _one_way(name, effect.by_direction, way, UNITS[rotary][effect.by_direction])
            for way in (DIRECTIONS if effect.by_direction else ())
        ),
    )


def _one_way(effect: str, friction: str, way: str, unit: str) -> DerivedQuantity:
    """Friction coefficient of one direction: (1 + a) F forwards, (1 - a) F backwards [unit]."""

    def formula(p: Mapping[str, float]) -> float:
        return p[friction] * (1.0 + DIRECTIONS[way] * p[f"{effect}_ratio"])

    return DerivedQuantity(name=way, unit=unit, formula=formula)


def unit_of(constant: Constant, scale: Scale) -> float:
    """Value that a constant of an effect is measured in [SI]."""
    of = {"force": scale.force, "speed": scale.speed, "sample": scale.sample}
    return of.get(constant.of, 1.0)


def _unknown(name: str, constant: Constant, of: float) -> Unknown:
    return Unknown(
        name=name,
        start=constant.plausible * of,
        lower=constant.lower * of,
        upper=constant.upper * of,
        logarithmic=False,
        scale=(constant.std or constant.plausible) * of,
        prior=constant.plausible * of,
        std=None if constant.std is None else constant.std * of,
    )
