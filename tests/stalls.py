"""How late a process of this computer wakes: what no program in real time can do anything about.

A computer that runs tests may stop, because another one borrows its processor. A process of its own
sleeps again and again, and keeps by how much it woke late. As a script, this file is that process:
it answers each line on its input with the largest delay since the line before [s].
"""

import select
import subprocess
import sys
import time

PERIOD = 0.005
"""[s] Time for which the process sleeps."""


class Stalls:
    """The process that measures."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-S", __file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
        )

    @property
    def pid(self) -> int:
        return self._process.pid

    def largest(self) -> float:
        """The largest delay since the last call [s]."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("\n")
        return float(self._process.stdout.readline())

    def close(self) -> None:
        self._process.communicate()


def measure() -> None:
    largest = 0.0
    before = time.monotonic()
    while True:
        asked = select.select([sys.stdin], [], [], PERIOD)[0]
        now = time.monotonic()  # once a turn, so that no stop falls between two measurements
        largest = max(largest, now - before - PERIOD)
        before = now
        if not asked:
            continue
        if sys.stdin.readline():
            print(largest, flush=True)
            largest = 0.0
        else:
            return


if __name__ == "__main__":
    measure()
