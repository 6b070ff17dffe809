"""Compiles functions with numba, or leaves them as they are, and caches kernels on disk.

numba's cache notices a change in the file of a compiled function, but not in the files of its
callees. It would run an old drive under a new integrator. Therefore each state of all source files
has a cache folder of its own.
"""

from __future__ import annotations

import hashlib
import os
import sys
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

ENABLED = os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")

# error_model: a division by zero gives infinity, without a check at every division; the divisors of
# the model are sums of positive terms. nogil: threads simulate side by side. forceinline: the
# kernel becomes one function, so that the stage record lives in registers.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "forceinline": True}


def cache_root() -> Path:
    """Folder of the compiled kernels: ROADLOAD_CACHE, or the user's cache folder."""
    given = os.environ.get("ROADLOAD_CACHE")
    if given:
        return Path(given)
    user = os.environ.get("XDG_CACHE_HOME")
    return (Path(user) if user else Path.home() / ".cache") / "road-load-bench"


def use_cache(sources: Sequence[str], names: Sequence[str]) -> None:
    """Set the folder of numba's cache by the content of these files and the effects' names."""
    if not ENABLED:
        return
    import numba

    state = hashlib.sha256(f"{sys.version} {numba.__version__} {list(names)}".encode())
    for source in sources:
        state.update(Path(source).read_bytes())
    folder = cache_root() / state.hexdigest()[:16]
    numba.config.__dict__["CACHE_DIR"] = str(folder)


def compile_function(function: Callable[..., Any], *, on_disk: bool = False) -> Callable[..., Any]:
    """Compile a function at its first call; without a compiler return the function itself."""
    if not ENABLED:
        return function
    import numba

    # Only functions on disk are called from Python. The others need no way in from there, which
    # costs two fifths of their compilation.
    wrappers = {"no_cpython_wrapper": not on_disk, "no_cfunc_wrapper": True}
    dispatcher = numba.njit(cache=on_disk, **{**OPTIONS, **wrappers})(function)
    if on_disk:
        dispatcher.compile = one_at_a_time(dispatcher.compile, dispatcher.stats.cache_path)
    found: Callable[..., Any] = dispatcher
    return found


def one_at_a_time(action: Callable[..., Any], folder: str) -> Callable[..., Any]:
    """Let one process at a time do an action, of all processes that use this folder.

    A kernel takes ten to twenty seconds to compile. Processes that need the same kernel wait
    for the first of them, and load what it left. Two at once could mix up the entries of numba's
    index.
    """
    import fcntl

    @wraps(action)
    def alone(*arguments: Any) -> Any:
        place = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(place, fcntl.LOCK_EX)
            return action(*arguments)
        finally:
            os.close(place)  # this also frees the lock, as does the end of the process

    return alone


def make_private_copy() -> Callable[..., Any]:
    """Make a compiled function that copies the record in an array to private memory.

    No other pointer leads to the copy. Once everything is inlined around it, the compiler keeps the
    copy in registers and omits fields that are only written. `make_write_back` makes the way back.
    """
    from numba.core import cgutils
    from numba.extending import intrinsic

    llvm: Any = cgutils  # has no types

    @intrinsic
    def private_copy(_typing: Any, array: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            found = context.make_array(array)(context, builder, arguments[0]).data
            place = llvm.alloca_once(builder, found.type.pointee)
            llvm.raw_memcpy(builder, place, found, llvm.intp_t(array.dtype.size), 1)
            return place

        return array.dtype(array), generate

    found: Callable[..., Any] = private_copy
    return found


def make_write_back() -> Callable[..., Any]:
    """Make a compiled function (copy, array) that copies a private record back to its array."""
    from numba.core import cgutils, types
    from numba.extending import intrinsic

    llvm: Any = cgutils  # has no types

    @intrinsic
    def write_back(_typing: Any, record: Any, array: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            target = context.make_array(array)(context, builder, arguments[1]).data
            llvm.raw_memcpy(builder, target, arguments[0], llvm.intp_t(record.size), 1)
            return context.get_dummy_value()

        return types.none(record, array), generate

    found: Callable[..., Any] = write_back
    return found
