"""Laws of the blind trial: other forms of the library's effects, and effects outside the library.

Every module declares its law like an effect of `plant_emulator.effects`, under its own name. Only
`plant_emulator.blind` may import this folder, because the diagnosis must not see these laws.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import TYPE_CHECKING

from plant_emulator.effects.declaration import read_effect

if TYPE_CHECKING:
    from plant_emulator.effects import Effect


def names() -> list[str]:
    """Names of all laws, sorted."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))


def load(name: str) -> Effect:
    """Load the law of that name."""
    return read_effect(name, importlib.import_module(f"{__name__}.{name}"))
