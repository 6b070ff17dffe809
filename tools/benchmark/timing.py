"""Measure the processor time of an action, alone or in turns with another one."""

from __future__ import annotations

import gc
from collections.abc import Callable
from statistics import median
from time import process_time

Action = Callable[[], object]

ROUNDS = 15
# Duration of one measurement [s]: far above the resolution of the clock.
LASTING = 0.02


def repetitions(action: Action) -> int:
    """Number of runs in one measurement; this also warms the action up."""
    action()
    return max(1, round(LASTING / max(duration(action, 1), 1e-7)))


def duration(action: Action, times: int) -> float:
    """Mean processor time of a run [s], over this many runs in a row."""
    started = process_time()
    for _ in range(times):
        action()
    return (process_time() - started) / times


def side_by_side(ours: Action, peers: Action, rounds: int = ROUNDS) -> tuple[float, float]:
    """Median processor times of both actions [s], in turns, so that both see the same machine."""
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
    """Median processor time of a run [s]."""
    times = repetitions(action)
    return median(duration(action, times) for _ in range(rounds))
