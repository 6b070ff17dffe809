"""Runs the scan in real time: a thread calls it at absolute deadlines and measures the lateness.

A late scan does not move the deadlines of later scans, so delays do not add up. A scan that is
more than `GIVE_UP` late (the machine slept) starts a new time base. The lost time is counted.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from statistics import quantiles

GIVE_UP = 0.25  # [s]
# The percentiles are taken over so many scans: the last 100 s in real time.
REMEMBERED = 10_000


@dataclass(frozen=True, kw_only=True)
class TimingReport:
    """Figures of how well real time was kept; times in seconds of the wall clock.

    real_time_factor : elapsed emulated time over the time that should have elapsed
    lateness : begin of a scan minus its deadline
    lost : total lateness that new time bases gave up
    """

    scans: int
    real_time_factor: float
    lateness_p50: float
    lateness_p99: float
    lateness_max: float
    scan_mean: float
    scan_max: float
    lost: float

    def __str__(self) -> str:
        """The figures in one line."""
        return (
            f"{self.scans} scans, real-time factor {self.real_time_factor:.4f}, "
            f"lateness p50 {1e3 * self.lateness_p50:.2f} p99 {1e3 * self.lateness_p99:.2f} "
            f"max {1e3 * self.lateness_max:.2f} ms, scan mean {1e6 * self.scan_mean:.0f} "
            f"max {1e6 * self.scan_max:.0f} us, lost {1e3 * self.lost:.0f} ms"
        )


class ScanTimer:
    """Calls `scan` every `period` seconds until `stop`. An error of `scan` goes to `on_error`."""

    def __init__(
        self, scan: Callable[[], None], period: float, on_error: Callable[[Exception], None]
    ) -> None:
        self.period = period
        self._scan, self._on_error = scan, on_error
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="scan", daemon=True)
        self._late: deque[float] = deque(maxlen=REMEMBERED)
        self._scans = 0
        self._late_max = self._busy = self._busy_max = self._lost = self._elapsed = 0.0

    def start(self) -> None:
        """Start the thread; the first scan comes after one period."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread and wait for its last scan."""
        self._stopping.set()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join()

    def _run(self) -> None:
        try:
            self._scan_at_deadlines()
        except Exception as error:  # noqa: BLE001 - the loop's thread must learn of any of them
            self._on_error(error)

    def _scan_at_deadlines(self) -> None:
        start = deadline = time.perf_counter()
        while not self._stopping.is_set():
            deadline += self.period
            begin = self._wait(deadline)
            late = begin - deadline
            if late > GIVE_UP:
                self._lost += late
                deadline = begin
            self._scan()
            self._count(late, time.perf_counter() - begin)
            self._elapsed = begin - start

    def _wait(self, deadline: float) -> float:
        """Sleep until the deadline; return the time at which the sleep ended."""
        while (now := time.perf_counter()) < deadline:
            time.sleep(deadline - now)
        return now

    def _count(self, late: float, busy: float) -> None:
        self._scans += 1
        self._late.append(late)
        self._late_max = max(self._late_max, late)
        self._busy += busy
        self._busy_max = max(self._busy_max, busy)

    def report(self) -> TimingReport:
        """The figures so far."""
        late = [*self._late] or [0.0]
        cuts = quantiles([*late, late[-1]], n=100)
        scans = max(self._scans, 1)
        elapsed = max(self._elapsed, self.period)
        return TimingReport(
            scans=self._scans,
            real_time_factor=self._scans * self.period / elapsed,
            lateness_p50=cuts[49],
            lateness_p99=cuts[98],
            lateness_max=self._late_max,
            scan_mean=self._busy / scans,
            scan_max=self._busy_max,
            lost=self._lost,
        )
