"""The library of effects of an axis."""

from __future__ import annotations

from plant_emulator.diagnosis.axis.effects.effect import Effect, Shape, Size
from plant_emulator.diagnosis.axis.effects.friction import FRICTION
from plant_emulator.diagnosis.axis.effects.motion_and_force import FORCES, MOTION, TIMING

LIBRARY = (*FRICTION, *MOTION, *FORCES)
NAMES = tuple(dict.fromkeys(one.name for one in LIBRARY))

__all__ = ["LIBRARY", "NAMES", "TIMING", "Effect", "Shape", "Size"]
