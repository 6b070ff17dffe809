"""Loads a user's own effects of an axis: one Python file each, which gives the effect its name.

docstring    what it is (first line), equation and source
SUBSYSTEM    where it acts: gear, load, drive, ...
SIZES        linear constants, a Size each
SHAPES       nonlinear constants, a Shape each, if it has some
columns      columns(context, shapes) -> force per size at context.motion.time, an array a size
replaced     for an effect of the force, in place of SIZES and columns:
             replaced(force, time, shapes) -> force that acts at these times
"""

from __future__ import annotations

import importlib.util
from keyword import iskeyword
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.diagnosis.axis.effects import NAMES, Effect, Shape, Size
from plant_emulator.errors import ParameterError, place_in

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import ModuleType

    from plant_emulator.diagnosis.axis.effects.effect import Context, Shapes
    from plant_emulator.signals.log import Array


def own_effects(paths: Sequence[str | Path]) -> tuple[Effect, ...]:
    """The effects in these files; raises ParameterError with file and what would be right."""
    found = tuple(_effect(Path(path)) for path in paths)
    names = [effect.name for effect in found]
    if doubled := [name for name in names if names.count(name) > 1]:
        raise ParameterError(
            f"two files are called {doubled[0]}.py, and an effect is called by its file; "
            "give one another name"
        )
    return found


def _effect(path: Path) -> Effect:
    name = path.stem
    if not name.isidentifier() or iskeyword(name) or name in NAMES:
        raise ParameterError(
            f"{path}: an effect is called by its file, and {name!r} is "
            f"{'one of the library' if name in NAMES else 'no name in Python'}; "
            "give it another name"
        )
    module = _module(path)
    title, _, equation = (module.__doc__ or "").strip().partition("\n")
    subsystem = getattr(module, "SUBSYSTEM", None)
    sizes, shapes = (
        _constants(path, module, "SIZES", Size),
        _constants(path, module, "SHAPES", Shape),
    )
    columns, replaced = (getattr(module, law, None) for law in ("columns", "replaced"))
    has_law = callable(columns) if sizes else bool(shapes) and callable(replaced)
    for fault, wanted in (
        (not title, "a docstring that says what the effect is"),
        (not isinstance(subsystem, str), "SUBSYSTEM, as in SUBSYSTEM = 'gear'"),
        (not has_law, "SIZES and a function columns, or SHAPES and a function replaced,"),
    ):
        if fault:
            raise ParameterError(f"{path}: {wanted} is needed")
    return Effect(
        name=name,
        title=title.rstrip("."),
        subsystem=str(subsystem),
        equation=equation.strip(),
        sizes=sizes,
        shapes=shapes,
        columns=_checked_columns(path, columns, len(sizes)) if sizes else None,
        refers=True,
        replaced=None if sizes else _checked_force(path, replaced),
    )


def _module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise ParameterError(f"{path}: no Python file with an effect")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise _fault(path, error) from error
    return module


def _constants(path: Path, module: ModuleType, name: str, kind: type) -> tuple[Any, ...]:
    found = tuple(getattr(module, name, ()))
    for one in found:
        if not isinstance(one, kind):
            raise ParameterError(f"{path}: {name}: {one!r}; a {kind.__name__} is needed")
        if isinstance(one, Shape) and not 0.0 < one.lower < one.upper:
            raise ParameterError(
                f"{path}: {name}: {one.name} from {one.lower:g} to {one.upper:g}; "
                "two bounds above 0, the lower one first, are needed"
            )
    return found


def _checked_columns(
    path: Path, law: Any, count: int
) -> Callable[[Context, Shapes], Sequence[Array]]:
    def columns(context: Context, shapes: Shapes) -> Sequence[Array]:
        try:
            found = [np.asarray(one, dtype=np.float64) for one in law(context, shapes)]
        except Exception as error:
            raise _fault(path, error) from error
        if len(found) != count:
            raise ParameterError(f"{path}: {len(found)} columns; one a size, {count}, is needed")
        for one in found:
            _check(path, one, len(context.motion.time))
        return found

    return columns


def _checked_force(path: Path, law: Any) -> Callable[..., Array]:
    def replaced(force: Callable[[Array], Array], time: Array, shapes: Shapes) -> Array:
        try:
            found = np.asarray(law(force, time, shapes), dtype=np.float64)
        except Exception as error:
            raise _fault(path, error) from error
        _check(path, found, len(time))
        return found

    return replaced


def _check(path: Path, values: Array, count: int) -> None:
    if values.shape != (count,) or not np.isfinite(values).all():
        raise ParameterError(
            f"{path}: an array of shape {values.shape} with {int(np.sum(~np.isfinite(values)))} "
            f"values that are not finite; shape ({count},), all finite, is needed"
        )


def _fault(path: Path, error: Exception) -> ParameterError:
    return ParameterError(place_in([str(path)], error) or f"{path}: {error}")
