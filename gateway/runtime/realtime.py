"""Ask the system for real time, and say whether it was granted.

SCHED_FIFO decides the wake-up (p99 0.1 ms instead of some ms on a loaded machine), mlockall keeps
pages in memory, and the garbage collector is stopped because its full run takes longer than a
tick. None of it is needed to work.
"""

import ctypes
import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

PRIORITY: Final = 30
LOCK_CURRENT_AND_FUTURE: Final = 3


@contextmanager
def real_time() -> Iterator[str]:
    """Real time for this process while inside; what was granted, in words."""
    policy, priority = os.sched_getscheduler(0), os.sched_getparam(0)
    granted = [f"SCHED_FIFO {_fifo()}", f"memory lock {_lock()}"]
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield ", ".join(granted)
    finally:
        gc.enable()
        gc.unfreeze()
        ctypes.CDLL(None).munlockall()
        os.sched_setscheduler(0, policy, priority)


def _fifo() -> str:
    try:
        # children must not inherit it: the recorder would compete with the loop
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(PRIORITY))
    except OSError as error:
        return f"no ({error.strerror})"
    return f"yes, priority {PRIORITY}"


def _lock() -> str:
    library = ctypes.CDLL(None, use_errno=True)
    if library.mlockall(LOCK_CURRENT_AND_FUTURE):
        return f"no ({os.strerror(ctypes.get_errno())})"
    return "yes"
