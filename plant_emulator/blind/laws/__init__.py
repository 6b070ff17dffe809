"""Laws that only the blind trial simulates with: other forms than the library's, or none of it.

Every module is declared like an effect of `plant_emulator.effects`, under a name of its own. The
diagnosis must not know them: only `plant_emulator.blind` may import this folder.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import effect_of

if TYPE_CHECKING:
    from plant_emulator.effects import Effect


def names() -> list[str]:
    """Names of the laws."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))


def load(name: str) -> Effect:
    """The law of that name."""
    return effect_of(name, importlib.import_module(f"{__name__}.{name}"))
