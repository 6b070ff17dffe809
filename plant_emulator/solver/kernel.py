"""Builds the simulation kernel: the model's plain functions, chained with the effects and compiled.

The functions of `model` and `solver` are ordinary Python. For one list of effects, building means:
 1. write the few functions that only the list determines (`glue`);
 2. rebind every function to these and to its compiled callees (`binding`);
 3. compile `stepper.run` and `stepper.advance` with numba and keep them on disk (`compiler`).

Values of parameters are data. A changed value compiles nothing, nor does an effect that is switched
on, once the kernels exist (`kernel_for`): without effects, with the effects that have memories,
with those that have none, with the user's own alone, and with all. With NUMBA_DISABLE_JIT=1 step 3
is left out, and the same functions run as plain Python.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property, wraps
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from plant_emulator import effects
from plant_emulator.errors import ParameterError
from plant_emulator.model import drive, drum, gear, implicit_stage, laws, stage
from plant_emulator.model.parameters import UNITS
from plant_emulator.solver import binding, compiler, dead_time, glue, observer, sdirk, stepper
from plant_emulator.solver.binding import bind, own_functions
from plant_emulator.solver.effect_check import check_effects, memory_names, raise_in_effects

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
    observer,
    stepper,
)

# Files that a compiled kernel depends on, beside this file and those of the effects.
SOURCES = (*MODULES, glue, binding, compiler)


@dataclass(frozen=True)
class Kernel:
    """The compiled model, and the layout of its records.

    effects : by name; parameters, stage : names of the fields of the two records
    run, advance : see `stepper`; starts : initial value of each memory, as a function of p
    """

    effects: Mapping[str, Effect]
    parameters: tuple[str, ...]
    stage: tuple[str, ...]
    run: Function
    advance: Function
    starts: tuple[Function, ...]

    def parameter_record(self, values: Mapping[str, float]) -> Record:
        """The flat record p of parameter values; parameters of effects default to neutral.

        Raises ParameterError for a name that is no parameter.
        """
        for name in values.keys() - self._names:
            raise ParameterError(f"{name}: neither a parameter of the bench nor of an effect")
        return record(self.parameters, {**self.neutral_values, **values})

    @cached_property
    def _names(self) -> frozenset[str]:
        return frozenset(self.parameters)

    @cached_property
    def neutral_values(self) -> Mapping[str, float]:
        """Values of the effects' parameters at which the bench is nominal [SI]."""
        return effects.neutral_values(self.effects)

    def stage_record(self) -> Record:
        """A stage record with all fields zero."""
        return record(self.stage, {})

    def state(self, p: Record, backlash_angle: float) -> State:
        """State vector at rest at that angle over the backlash [rad], memories at their start."""
        x = [0.0] * stage.FIRST_MEMORY + [start(p) for start in self.starts]
        x[stage.BACKLASH] = backlash_angle
        return vector(x)

    def work(self) -> State:
        """Work space of the stepper, five state vectors."""
        size = stage.FIRST_MEMORY + len(self.starts)
        rows = [[0.0] * size for _ in range(5)]
        return np.array(rows) if compiler.ENABLED else rows


def record(names: tuple[str, ...], values: Mapping[str, float]) -> Record:
    """A record of floats: a structured scalar, or a plain namespace without compiler."""
    if not compiler.ENABLED:
        zeros = dict.fromkeys(names, 0.0)
        return cast("Record", SimpleNamespace(**zeros | {n: float(v) for n, v in values.items()}))
    data = np.array([values.get(name, 0.0) for name in names], dtype=np.float64)
    return cast("Record", data.view(layout(names))[0])


@cache
def layout(names: tuple[str, ...]) -> np.dtype[np.void]:
    """Type of a structured scalar with float fields of those names."""
    return np.dtype((np.record, [(name, np.float64) for name in names]))


def vector(values: list[float]) -> State:
    """A vector of floats: an array, or a list without compiler."""
    return np.array(values) if compiler.ENABLED else values


def shipped_effects() -> dict[str, Effect]:
    """All shipped effects by name."""
    return {name: effects.load(name) for name in effects.names()}


# A user's own effects that this process uses beside the shipped effects.
_user_effects: list[Effect] = []


def use_own_effects(*own: Effect) -> None:
    """Let the kernels of this process have these effects of a user's own, and no others of them."""
    _user_effects[:] = own


def _own_effects() -> tuple[Effect, ...]:
    """Effects beside the shipped ones: those of loaded parameter sets, and the user's own."""
    found = {effect.name: effect for effect in (*effects.effects_of_sets(), *_user_effects)}
    return tuple(found.values())


def kernel() -> Kernel:
    """The kernel with all shipped effects and the user's own effects; built once a process."""
    return _kernel(_own_effects())


@cache
def _kernel(user_effects: tuple[Effect, ...]) -> Kernel:
    return build(_library(user_effects))


def _library(user_effects: tuple[Effect, ...]) -> dict[str, Effect]:
    return {**shipped_effects(), **{effect.name: effect for effect in user_effects}}


@cache
def plain_kernel() -> Kernel:
    """The kernel without effects; `tools/bench.py` measures the time that neutral effects cost."""
    return build({})


@cache
def partial_kernel(*, remembering: bool) -> Kernel:
    """The kernel with the shipped effects that have memories, or with those that have none.

    Most simulations have one effect, and neutral effects of the other kind would cost time.
    """
    return build({n: e for n, e in shipped_effects().items() if bool(e.memories) is remembering})


@cache
def own_kernel(user_effects: tuple[Effect, ...]) -> Kernel:
    """The kernel with a user's own effects alone: soon compiled, and without shipped effects."""
    return build({effect.name: effect for effect in user_effects})


@cache
def _neutral(user_effects: tuple[Effect, ...]) -> dict[str, tuple[float, bool | None]]:
    """Neutral value of each effect parameter, and whether its effect has memories, by name.

    The second is None for a user's own effects, which have a kernel of their own.
    """
    remembering = {name: bool(effect.memories) for name, effect in shipped_effects().items()}
    return {
        parameter: (value, remembering.get(name))
        for name, effect in _library(user_effects).items()
        for parameter, value in effects.neutral_values({name: effect}).items()
    }


def kernel_for(values: Mapping[str, float]) -> tuple[Kernel, Mapping[str, float]]:
    """The smallest kernel that has all effects that are not neutral, and the values it takes.

    Effects at their neutral values would change no bit of the result.
    """
    others = [name for name in values if name not in UNITS]
    if not others:
        return plain_kernel(), values
    own = _own_effects()
    table = _neutral(own)
    if not table.keys() >= set(others):
        return kernel(), values
    kinds = {table[name][1] for name in others if values[name] != table[name][0]}
    if len(kinds) > 1:
        return kernel(), values
    if not kinds:
        model = plain_kernel()
    elif (remembering := kinds.pop()) is None:
        model = own_kernel(own)
    else:
        model = partial_kernel(remembering=remembering)
    names = frozenset(model.parameters)
    return model, {name: value for name, value in values.items() if name in names}


def build(library: Mapping[str, Effect]) -> Kernel:
    """Build the kernel with these effects, by the steps of the module's docstring.

    Raises ParameterError, with file and line, for a fault in a user's own effect.
    """
    check_effects(library)
    files = [*(str(module.__file__) for module in SOURCES), __file__]
    compiler.use_cache([*files, *(effect.file for effect in library.values())], list(library))
    compiled = _compile_glue(library)
    if compiler.ENABLED:
        compiled[stepper.private_copy] = compiler.make_private_copy()
        compiled[stepper.write_back] = compiler.make_write_back()
    for module in MODULES[1:]:
        for function in own_functions(module):
            bind(function, compiled)
    return Kernel(
        effects=library,
        parameters=(*UNITS, *effects.neutral_values(library)),
        stage=(*stage.STAGE, *memory_names(library)),
        run=pass_arrays(compiled[stepper.run], library),
        advance=pass_arrays(compiled[stepper.advance], library),
        starts=tuple(m.start for e in library.values() for m in e.memories.values()),
    )


def _compile_glue(library: Mapping[str, Effect]) -> dict[Function, Function]:
    """The compiled functions of the glue, by the functions of the model that they replace."""
    names: dict[str, Function] = {}
    for law in laws.LAWS:
        names[f"nominal_{law.__name__}"] = compiler.compile_function(law)
    for effect in library.values():
        helpers: dict[Function, Function] = {}
        for key, function in effect.laws.items():
            names[f"{effect.name}__{key}"] = bind(function, helpers)
        for key, memory in effect.memories.items():
            names[f"{effect.name}_{key}__advance"] = bind(memory.advance, helpers)
    exec(compile(glue.glue(library), "<glue>", "exec"), names)  # our own text, made from names
    copies = (implicit_stage.load, implicit_stage.store, implicit_stage.advance_memories)
    replaced: tuple[Function, ...] = (*laws.LAWS, *copies)
    return {f: compiler.compile_function(names[f.__name__]) for f in replaced}


def pass_arrays(function: Function, library: Mapping[str, Effect]) -> Function:
    """Wrap a compiled function so that it takes records; it gets the arrays that hold them.

    Passing the arrays is ten times faster. If an effect is at fault, the error names file and line,
    also for a fault that the compiler finds.
    """

    @wraps(function, updated=())
    def call(*arguments: Any) -> Any:
        *others, stage, p, out = arguments
        if compiler.ENABLED:
            stage, p = stage.base, p.base
        try:
            return function(*others, stage, p, out)
        except Exception as error:
            raise_in_effects(error, library)
            raise

    return call
