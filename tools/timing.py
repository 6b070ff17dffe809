"""CPU time of two ways to do the same, measured side by side."""

from __future__ import annotations

import gc
from collections.abc import Callable
from statistics import median
from time import process_time

Action = Callable[[], object]

ROUNDS = 15
# One measurement lasts about this long [s], far above the clock's resolution.
LASTING = 0.02


def repetitions(action: Action) -> int:
    """How often to run it in one measurement; runs it, which also warms it up."""
    action()
    return max(1, round(LASTING / max(duration(action, 1), 1e-7)))


def duration(action: Action, times: int) -> float:
    """CPU time of one run, mean over so many in a row [s]."""
    started = process_time()
    for _ in range(times):
        action()
    return (process_time() - started) / times


def side_by_side(ours: Action, peers: Action, rounds: int = ROUNDS) -> tuple[float, float]:
    """Median CPU times of one run [s], measured in turns so that both see the same machine."""
    counts = repetitions(ours), repetitions(peers)
    gc.collect()
    gc.disable()
    try:
        found = [(duration(ours, counts[0]), duration(peers, counts[1])) for _ in range(rounds)]
    finally:
        gc.enable()
    first, second = zip(*found, strict=True)
    return median(first), median(second)


def alone(action: Action, rounds: int = ROUNDS) -> float:
    """Median CPU time of one run [s]."""
    times = repetitions(action)
    return median(duration(action, times) for _ in range(rounds))
