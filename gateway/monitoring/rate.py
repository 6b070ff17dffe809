"""Rate limit of the log (pure): a PLC that comes and goes must not fill the journal.

A bucket of tokens: BURST lines may come at once, and one more each EVERY seconds. What comes faster
is left out and counted, except the newest line, which is held until it may be written.
"""

from collections.abc import Callable, Sequence
from typing import Final

BURST: Final = 20
EVERY: Final = 3.0
"""[s] Time for one more line."""


class Rate:
    """Lets lines through; left_out : text of a line that tells how many are left out."""

    def __init__(self, left_out: Callable[[int], str]) -> None:
        self._tell = left_out
        self._tokens, self._now = float(BURST), 0.0
        self._held: str | None = None
        self._count = 0

    def filter(self, lines: Sequence[str], now: float, *, lost: int = 0) -> list[str]:
        """Lines to write now [s]; lost : count of lines that the caller knows are missing."""
        self._tokens = min(float(BURST), self._tokens + (now - self._now) / EVERY)
        self._now, self._count = now, self._count + lost
        written = []
        for line in lines:
            if self._held is not None or self._tokens < 1.0:
                self._count += self._held is not None
                self._held = line
                continue
            written.append(line)
            self._tokens -= 1.0
        return written + (self.flush() if self._tokens >= 1.0 else [])

    def flush(self) -> list[str]:
        """The held line, and before it how many lines are left out."""
        written = [self._tell(self._count)] * (self._count > 0)
        written += [] if self._held is None else [self._held]
        self._tokens -= self._held is not None
        self._held, self._count = None, 0
        return written
