"""Rebinds functions to their compiled callees, so that a model of ordinary Python is compiled."""

from __future__ import annotations

import dis
import sys
from collections.abc import Callable, Iterator
from types import CodeType, FunctionType, ModuleType
from typing import Any

from plant_emulator.errors import ParameterError
from plant_emulator.solver import compiler, stepper

Function = Callable[..., Any]


def own_functions(module: ModuleType) -> list[Function]:
    """Functions that a module itself defines, in the order of its text: callees before callers."""
    return [
        f
        for f in vars(module).values()
        if isinstance(f, FunctionType) and f.__module__ == module.__name__
    ]


def bind(
    function: Function, compiled: dict[Function, Function], callers: tuple[Function, ...] = ()
) -> Function:
    """Compile a function and, before it, all its callees; each function is compiled once.

    compiled : the functions that are compiled already; it is extended
    callers : the functions whose compilation led here
    Raises ParameterError, with file and line, for a function that calls itself.
    """
    if function in compiled:
        return compiled[function]
    assert isinstance(function, FunctionType)
    code, names = function.__code__, dict(function.__globals__)
    if function in callers:
        raise ParameterError(
            f"{code.co_filename}:{code.co_firstlineno}: {function.__name__} calls itself; "
            "functions without recursion are needed"
        )
    for name in global_names(code):
        if isinstance(callee := function.__globals__.get(name), FunctionType):
            names[name] = bind(callee, compiled, (*callers, function))
    bound = FunctionType(code, names, function.__name__)
    # numba's cache imports a module by its name. The module of a user's effect has no name.
    bound.__module__ = function.__module__ if function.__module__ in sys.modules else __name__
    cached = function in (stepper.run, stepper.advance)
    compiled[function] = compiler.compile_function(bound, on_disk=cached)
    return compiled[function]


def global_names(code: CodeType) -> Iterator[str]:
    """Names that a function looks up in its module, without names of attributes."""
    for instruction in dis.get_instructions(code):
        if instruction.opname == "LOAD_GLOBAL":
            yield instruction.argval
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from global_names(constant)
