#!/usr/bin/env python3
"""Mutation test of the modules that stand between an error and the drum.

A mutant is a module with one change: in a comparison, number, truth value, boolean operator, sign,
sum or min/max. Decorators, annotations and texts stay as they are. The tests of the module run on
every mutant. A mutant that no test notices is a survivor: exit code 1.

A mutant lives in a forked process. The sources on disk stay as they are.
"""

import ast
import copy
import gc
import importlib
import os
import signal
import sys
import time
import types
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
EVERY = "tests/gateway/regulators/test_every_regulator.py"
TARGETS = {
    "gateway.cycle.limits": ("tests/gateway/cycle/test_limits.py",),
    "gateway.cycle.supervisor": ("tests/gateway/cycle/test_supervisor.py",),
    "gateway.cycle.samples": ("tests/gateway/cycle/test_samples.py",),
    "gateway.cycle.checks": ("tests/gateway/cycle/test_checks.py",),
    "gateway.cycle.command": ("tests/gateway/cycle/test_command.py",),
    "gateway.regulators.thesis": (EVERY, "tests/gateway/regulators/test_thesis.py"),
    "gateway.physics.following": (
        EVERY,
        "tests/gateway/regulators/test_compensated.py",
        "tests/gateway/regulators/test_learned.py",
    ),
    "gateway.physics.virtual_truck": (EVERY, "tests/gateway/regulators/test_compensated.py"),
    "gateway.regulators.compensated": (EVERY, "tests/gateway/regulators/test_compensated.py"),
    "gateway.regulators.learned": (EVERY, "tests/gateway/regulators/test_learned.py"),
}
"""The tests of each module, the quick ones first."""
OPTIONS = ("-x", "-q", "-p", "no:cacheprovider", "-W", "ignore", "--tb=no", "--assert=plain")
"""One failure is enough, and nobody reads it."""
WORKERS = 2
PATIENCE = 60
"""Time after which a mutant that hangs counts as noticed [s]."""

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
OPERATIONS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.BitOr: ast.BitAnd,
    ast.BitAnd: ast.BitOr,
}
NAMES = {"min": "max", "max": "min", "any": "all", "all": "any"}


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """A changed module: line, text before and after the change, syntax tree."""

    module: str
    line: int
    was: str
    now: str
    tree: ast.Module


def variants(node: ast.AST) -> Iterator[ast.AST]:
    """Every node that may replace this one."""
    if isinstance(node, ast.Compare):
        for place, operator in enumerate(node.ops):
            for other in COMPARISONS[type(operator)]:
                changed = copy.deepcopy(node)
                changed.ops[place] = other()
                yield changed
    elif isinstance(node, ast.BoolOp):
        other_operator = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        yield ast.BoolOp(op=other_operator, values=node.values)
    elif isinstance(node, ast.UnaryOp):
        yield node.operand
    elif isinstance(node, ast.BinOp) and type(node.op) in OPERATIONS:
        yield ast.BinOp(left=node.left, op=OPERATIONS[type(node.op)](), right=node.right)
    elif isinstance(node, ast.Name) and node.id in NAMES:
        yield ast.Name(id=NAMES[node.id], ctx=node.ctx)
    elif isinstance(node, ast.Constant):
        yield from (ast.Constant(value=value) for value in constants(node.value))


def constants(value: object) -> tuple[object, ...]:
    """Other values for a constant; none for a text and None."""
    if isinstance(value, bool):
        return (not value,)
    if isinstance(value, int | float):
        return (value + 1, value - 1)
    return ()


def places(node: ast.AST) -> Iterator[tuple[ast.AST, str, int | None]]:
    """Every place below a node that holds behaviour: parent, field, index in the field."""
    skipped = {"decorator_list", "annotation", "returns"}
    for field, value in ast.iter_fields(node):
        if field in skipped:
            continue
        for index, child in enumerate(value if isinstance(value, list) else [value]):
            if isinstance(child, ast.AST):
                yield node, field, index if isinstance(value, list) else None
                yield from places(child)


def unchanged(module: str) -> Mutant:
    """A mutant without a change."""
    return Mutant(module=module, line=0, was="", now="", tree=parse(module))


def parse(module: str) -> ast.Module:
    """Syntax tree of a module."""
    return ast.parse((ROOT / (module.replace(".", "/") + ".py")).read_text(encoding="utf-8"))


def mutants(module: str) -> Iterator[Mutant]:
    """Every mutant of a module."""
    tree = parse(module)
    for parent, field, index in list(places(tree)):
        held = getattr(parent, field)
        node = held if index is None else held[index]
        for other in variants(node):
            ast.copy_location(other, node)
            _put(parent, field, index, other)
            changed = ast.fix_missing_locations(copy.deepcopy(tree))
            _put(parent, field, index, node)
            yield Mutant(
                module=module,
                line=getattr(node, "lineno", 0),
                was=ast.unparse(node),
                now=ast.unparse(other),
                tree=changed,
            )


def _put(parent: ast.AST, field: str, index: int | None, node: ast.AST) -> None:
    if index is None:
        setattr(parent, field, node)
    else:
        getattr(parent, field)[index] = node


def is_noticed(mutant: Mutant) -> bool:
    """Whether the tests of the module fail on a mutant; they run in a process of their own."""
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) != 0
    code = 1
    try:
        signal.alarm(PATIENCE)
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        code = run_tests(mutant)
    finally:
        os._exit(code)


def run_tests(mutant: Mutant) -> int:
    """Run the tests with the mutant in the place of its module; their exit code."""
    import pytest  # loaded by the parent, so that a child does not wait for it

    # A module that holds a function of the unchanged one would go on calling that.
    for loaded in [one for one in sys.modules if one.split(".")[0] == "gateway"]:
        del sys.modules[loaded]
    changed = types.ModuleType(mutant.module)
    package, _, name = mutant.module.rpartition(".")
    sys.modules[mutant.module] = changed
    setattr(importlib.import_module(package), name, changed)
    exec(compile(mutant.tree, mutant.module, "exec"), changed.__dict__)
    return int(pytest.main([*OPTIONS, *TARGETS[mutant.module]]))


def main() -> int:
    """Try every mutant and print the survivors; the exit code."""
    os.chdir(ROOT)
    sys.path.insert(0, str(ROOT))
    importlib.import_module("hypothesis")
    importlib.import_module("pytest")
    for module in TARGETS:
        importlib.import_module(module)
    started = time.monotonic()
    for module, tests in TARGETS.items():
        if is_noticed(unchanged(module)):
            print(f"{module}: its tests fail without any change: {' '.join(tests)}")
            return 1
    everyone = [mutant for module in TARGETS for mutant in mutants(module)]
    gc.freeze()  # a child neither counts nor copies what it inherits
    with ThreadPoolExecutor(WORKERS) as pool:
        noticed = list(pool.map(is_noticed, everyone))
    survivors = [one for one, dead in zip(everyone, noticed, strict=True) if not dead]
    for one in survivors:
        print(f"{one.module}:{one.line}: {one.was}  ->  {one.now}: no test notices")
    seconds = time.monotonic() - started
    print(f"{len(everyone)} mutants, {len(survivors)} survivors, {seconds:.0f} s")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
