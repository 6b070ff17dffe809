"""Histogram of durations with a fixed number of bins (pure)."""

import math
from typing import Final

WIDTH: Final = 1e-5
BINS: Final = 20_000
"""Bins of 10 us up to 0.2 s; the last bin counts every longer duration, and `max` is exact."""


class Histogram:
    """Histogram of durations [s]; total : count of durations; max : the longest."""

    def __init__(self) -> None:
        self._counts = [0] * BINS
        self.total = 0
        self.max = 0.0

    def add(self, duration: float) -> None:
        """Count one duration [s]."""
        self._counts[min(max(int(duration / WIDTH), 0), BINS - 1)] += 1
        self.total += 1
        self.max = max(self.max, duration)

    def summary(self) -> dict[str, float]:
        """Median, 99 % quantile and longest duration [s]."""
        return {"p50": self.quantile(0.5), "p99": self.quantile(0.99), "max": self.max}

    def quantile(self, share: float) -> float:
        """Duration that this share does not exceed, as the upper edge of its bin [s]."""
        wanted, seen = max(1, math.ceil(share * self.total)), 0
        for index, count in enumerate(self._counts):
            seen += count
            if seen >= wanted:
                return self.max if index == BINS - 1 else min((index + 1) * WIDTH, self.max)
        return 0.0
