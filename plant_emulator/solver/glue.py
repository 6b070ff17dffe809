"""Source text of the functions that only the list of effects determines.

The functions are: each law followed by the effects that change it, the copying of states and
memories between vector and stage record, and the advance of the memories.
"""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

from plant_emulator.model import laws, stage
from plant_emulator.solver.effect_check import memory_names

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from plant_emulator.effects import Effect


def glue(library: Mapping[str, Effect]) -> str:
    """Source text of all these functions for the effects `library`, in their order."""
    lines: list[str] = []
    for law in laws.LAWS:
        lines += [
            f"def {law.__name__}(s, p):",
            f"    return {chain(law.__name__, library.values())}",
        ]
    states = [*stage.STATES, *memory_names(library)]
    lines += ["def load(x, s):", *(f"    s.{name} = x[{k}]" for k, name in enumerate(states))]
    lines += ["def store(s, x):", *(f"    x[{k}] = s.{name}" for k, name in enumerate(states))]
    lines += ["def advance_memories(base, a, s, p):", "    pass"]
    memories = zip(memory_names(library), advance_arguments(library), strict=True)
    lines += [
        f"    s.{name} = {name}__advance(base[{stage.FIRST_MEMORY + k}], a, {arguments}s, p)"
        for k, (name, arguments) in enumerate(memories)
    ]
    return "\n".join(lines) + "\n"


def chain(law: str, effects: Iterable[Effect]) -> str:
    """Expression of a law as these effects change it, one after the other."""
    value = f"nominal_{law}(s, p)"
    for effect in effects:
        if law in effect.laws:
            value = f"{effect.name}__{law}({value}, s, p)"
    return value


def advance_arguments(library: Mapping[str, Effect]) -> Iterator[str]:
    """Further arguments of the advance of each memory, as text.

    They are the value of the law that the memory follows, and the base of the memory beside it.
    """
    number = {name: stage.FIRST_MEMORY + k for k, name in enumerate(memory_names(library))}
    for k, effect in enumerate(library.values()):
        for memory in effect.memories.values():
            before = islice(library.values(), k)
            value = "" if memory.follows is None else f"{chain(memory.follows, before)}, "
            beside = f"{effect.name}_{memory.beside}"
            yield value + ("" if memory.beside is None else f"base[{number[beside]}], ")
