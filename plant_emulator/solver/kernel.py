"""Builds the simulation kernel: the model's plain functions, the effects chained in, compiled.

The functions of the model, from `laws` to `integrate`, are ordinary Python. Building means, for one
list of effects:
 1. write a few lines of glue that only the list determines: each law followed by the effects that
    change it, the copying of states and memories (`glue`);
 2. rebind every function to the glue and to its compiled callees;
 3. compile run and advance with numba, kept on disk.
Values of parameters are data: a changed value, or an effect switched on, compiles nothing once the
few kernels are there (`kernel_for`: without effects, with those that have memories, with those that
have none, with all). With NUMBA_DISABLE_JIT=1 step 3 is left out and the same functions run as they
are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, wraps
from itertools import islice
from math import nan
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from plant_emulator import effects
from plant_emulator.errors import ParameterError
from plant_emulator.model import drive, drum, gear, implicit_stage, laws, stage
from plant_emulator.model.parameters import UNITS
from plant_emulator.solver import binding, compiler, dead_time, sdirk, stepper
from plant_emulator.solver.binding import bind, own_functions
from plant_emulator.solver.effect_check import memory_names, raise_in_effects, try_out

if TYPE_CHECKING:
    from plant_emulator.effects import Effect
    from plant_emulator.model.records import Record, State

Function = Callable[..., Any]
MODULES: tuple[ModuleType, ...] = (
    laws,
    drive,
    drum,
    gear,
    implicit_stage,
    sdirk,
    dead_time,
    stepper,
)


@dataclass(frozen=True)
class Kernel:
    """The compiled model and the layout of its records."""

    effects: Mapping[str, Effect]
    parameters: tuple[str, ...]
    stage: tuple[str, ...]
    run: Function
    advance: Function
    starts: tuple[Function, ...]

    def parameter_record(self, values: Mapping[str, float]) -> Record:
        """The flat record p; values not given keep their neutral value."""
        for name in values:
            if name not in self.parameters:
                raise ParameterError(f"{name}: neither a parameter of the bench nor of an effect")
        return record(self.parameters, {**effects.neutral(self.effects), **values})

    def stage_record(self) -> Record:
        """A stage record, all zero."""
        return record(self.stage, {})

    def state(self, p: Record, backlash_angle: float) -> State:
        """State at rest with the gap at that angle [rad], memories at their starts."""
        x = [0.0] * stage.FIRST_MEMORY + [start(p) for start in self.starts]
        x[stage.BACKLASH] = backlash_angle
        return vector(x)

    def work(self) -> State:
        """Work space of the stepper."""
        size = stage.FIRST_MEMORY + len(self.starts)
        rows = [[0.0] * size for _ in range(4)]
        return np.array(rows) if compiler.ENABLED else rows


def record(names: tuple[str, ...], values: Mapping[str, float]) -> Record:
    """A record of floats by attribute: a structured scalar, or a namespace without compiler."""
    if not compiler.ENABLED:
        zeros = dict.fromkeys(names, 0.0)
        return cast("Record", SimpleNamespace(**zeros | {n: float(v) for n, v in values.items()}))
    data = np.array([values.get(name, 0.0) for name in names], dtype=np.float64)
    return cast("Record", data.view(layout(names))[0])


@cache
def layout(names: tuple[str, ...]) -> np.dtype[np.void]:
    """Type of a structured scalar of floats by those names."""
    return np.dtype((np.record, [(name, np.float64) for name in names]))


def vector(values: list[float]) -> State:
    """A state vector: an array, or a list without compiler."""
    return np.array(values) if compiler.ENABLED else values


def shipped() -> dict[str, Effect]:
    """All shipped effects by name."""
    return {name: effects.load(name) for name in effects.names()}


# A user's own effects that this process knows beside the shipped ones.
_own: list[Effect] = []


def know(*own: Effect) -> None:
    """Let every kernel of this process have these effects of a user's own."""
    _own[:] = own


def kernel() -> Kernel:
    """The kernel with the shipped effects and those that this process knows; built once."""
    return _kernel(tuple(_own))


@cache
def _kernel(own: tuple[Effect, ...]) -> Kernel:
    return build(_known(own))


def _known(own: tuple[Effect, ...]) -> dict[str, Effect]:
    return {**shipped(), **{effect.name: effect for effect in own}}


@cache
def plain_kernel() -> Kernel:
    """The kernel without effects: for what effects cost that are not there see `tools/bench.py`."""
    return build({})


@cache
def partial_kernel(*, remembering: bool) -> Kernel:
    """The kernel with the shipped effects that have memories, or with those that have none: most
    simulations have one effect, and the other kind's cost time even where they are not there.
    """
    return build({n: e for n, e in shipped().items() if bool(e.memories) is remembering})


@cache
def _neutral(own: tuple[Effect, ...]) -> dict[str, tuple[float, bool | None]]:
    """Neutral value of every parameter of an effect, and whether that effect has memories, by the
    parameter's name; None of a user's own effects, which no partial kernel has.
    """
    remembering = {name: bool(effect.memories) for name, effect in shipped().items()}
    return {
        parameter: (value, remembering.get(name))
        for name, effect in _known(own).items()
        for parameter, value in effects.neutral({name: effect}).items()
    }


def kernel_for(values: Mapping[str, float]) -> tuple[Kernel, Mapping[str, float]]:
    """The kernel that these values need, and those of them that it takes.

    The least one with all effects that are not at their neutral values: the others would do
    nothing there, bit for bit.
    """
    others = [name for name in values if name not in UNITS]
    if not others:
        return plain_kernel(), values
    known = _neutral(tuple(_own))
    neutral = {name: known.get(name, (nan, None)) for name in others}
    there = {kind for name, (value, kind) in neutral.items() if values[name] != value}
    if None in there or len(there) > 1:
        return kernel(), values
    model = partial_kernel(remembering=bool(there.pop())) if there else plain_kernel()
    taken = frozenset(model.parameters)
    return model, {name: value for name, value in values.items() if name in taken}


def glue(known: Mapping[str, Effect]) -> str:
    """Source of the functions that only the list of effects determines."""
    lines: list[str] = []
    for law in laws.LAWS:
        lines += [f"def {law.__name__}(s, p):", f"    return {chain(law.__name__, known.values())}"]
    states = [*stage.STATES, *memory_names(known)]
    lines += ["def load(x, s):", *(f"    s.{name} = x[{k}]" for k, name in enumerate(states))]
    lines += ["def store(s, x):", *(f"    x[{k}] = s.{name}" for k, name in enumerate(states))]
    lines += ["def memories(base, a, s, p):", "    pass"]
    lines += [
        f"    s.{name} = {name}__advance(base[{stage.FIRST_MEMORY + k}], a, {value}s, p)"
        for k, (name, value) in enumerate(zip(memory_names(known), followed(known), strict=True))
    ]
    return "\n".join(lines) + "\n"


def chain(law: str, effects: Iterable[Effect]) -> str:
    """Expression of a law as these effects, one after the other, change it."""
    value = f"nominal_{law}(s, p)"
    for effect in effects:
        if law in effect.laws:
            value = f"{effect.name}__{law}({value}, s, p)"
    return value


def followed(known: Mapping[str, Effect]) -> Iterator[str]:
    """What the advance of each memory takes besides: the value of the law that it follows, and the
    base of the memory beside it.
    """
    number = {name: stage.FIRST_MEMORY + k for k, name in enumerate(memory_names(known))}
    for k, effect in enumerate(known.values()):
        for memory in effect.memories.values():
            before = islice(known.values(), k)
            value = "" if memory.follows is None else f"{chain(memory.follows, before)}, "
            beside = f"{effect.name}_{memory.beside}"
            yield value + ("" if memory.beside is None else f"base[{number[beside]}], ")


def build(known: Mapping[str, Effect]) -> Kernel:
    """Chain, bind and compile; see the module's text."""
    try_out(known)
    own = (
        *(str(module.__file__) for module in MODULES),
        __file__,
        binding.__file__,
        compiler.__file__,
    )
    compiler.use_cache([*own, *(effect.file for effect in known.values())], list(known))
    compiled: dict[Function, Function] = {}
    names: dict[str, Function] = {}
    for law in laws.LAWS:
        names[f"nominal_{law.__name__}"] = compiler.compiled(law)
    for effect in known.values():
        helpers: dict[Function, Function] = {}
        for key, function in effect.laws.items():
            names[f"{effect.name}__{key}"] = bind(function, helpers)
        for key, memory in effect.memories.items():
            names[f"{effect.name}_{key}__advance"] = bind(memory.advance, helpers)
    exec(compile(glue(known), "<glue>", "exec"), names)  # our own text, made from names
    replaced: tuple[Function, ...] = (
        *laws.LAWS,
        implicit_stage.load,
        implicit_stage.store,
        implicit_stage.memories,
    )
    for function in replaced:
        compiled[function] = compiler.compiled(names[function.__name__])
    if compiler.ENABLED:
        compiled |= {
            stepper.private: compiler.private_copy(),
            stepper.publish: compiler.write_back(),
        }
    for module in MODULES[1:]:
        for function in own_functions(module):
            bind(function, compiled)
    return Kernel(
        effects=known,
        parameters=(*UNITS, *effects.neutral(known)),
        stage=(*stage.STAGE, *memory_names(known)),
        run=by_arrays(compiled[stepper.run], known),
        advance=by_arrays(compiled[stepper.advance], known),
        starts=tuple(m.start for e in known.values() for m in e.memories.values()),
    )


def by_arrays(function: Function, known: Mapping[str, Effect]) -> Function:
    """Give a compiled function the arrays that its records stand in: taken up ten times faster.

    Where an effect is at fault, also for what the compiler finds, the error names file and line.
    """

    @wraps(function, updated=())
    def call(*arguments: Any) -> Any:
        *others, stage, p, out = arguments
        if compiler.ENABLED:
            stage, p = stage.base, p.base
        try:
            return function(*others, stage, p, out)
        except Exception as error:
            raise_in_effects(error, known)
            raise

    return call
