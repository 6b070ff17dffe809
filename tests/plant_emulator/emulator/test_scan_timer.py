"""The scan timer, with a virtual clock that moves only by sleep and by work."""

import pytest

from plant_emulator.emulator import scan_timer
from plant_emulator.emulator.scan_timer import ScanTimer


class Clock:
    """A virtual clock. Each sleep takes `late` seconds longer than asked."""

    def __init__(self, late: float = 0.0) -> None:
        self.now, self.late = 100.0, late

    def perf_counter(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds + self.late


@pytest.fixture
def clock(monkeypatch):
    virtual = Clock()
    monkeypatch.setattr(scan_timer, "time", virtual)
    return virtual


def paced(clock, work, scans):
    """Run `scans` scans that take `work(number)` seconds each; return the report and the begins."""
    begins = []

    def scan() -> None:
        begins.append(round(clock.now - 100.0, 9))
        clock.now += work(len(begins))
        if len(begins) == scans:
            made.stop()

    errors = []
    made = ScanTimer(scan, 0.01, errors.append)
    made._run()
    assert not errors
    return made.report(), begins


def test_scans_begin_at_multiples_of_the_period(clock):
    report, begins = paced(clock, lambda number: 0.001, 5)
    assert begins == [0.01, 0.02, 0.03, 0.04, 0.05]
    assert report.real_time_factor == pytest.approx(1.0)
    assert report.scan_mean == pytest.approx(0.001)


def test_oversleeping_does_not_add_up(clock):
    clock.late = 0.002
    report, begins = paced(clock, lambda number: 0.0, 100)
    assert begins[-1] == pytest.approx(1.002)
    assert report.lateness_p50 == pytest.approx(0.002)
    assert report.lateness_max == pytest.approx(0.002)


def test_one_long_scan_is_caught_up_with(clock):
    report, begins = paced(clock, lambda number: 0.035 if number == 2 else 0.0, 8)
    assert begins == [0.01, 0.02, 0.055, 0.055, 0.055, 0.06, 0.07, 0.08]
    assert report.lateness_max == pytest.approx(0.025)
    assert report.scan_max == pytest.approx(0.035)
    assert report.lost == 0.0


def test_a_machine_that_slept_starts_a_new_time_base_and_the_loss_is_counted(clock):
    report, begins = paced(clock, lambda number: 5.0 if number == 1 else 0.0, 4)
    assert begins == [0.01, 5.01, 5.02, 5.03]
    assert report.lost == pytest.approx(4.99)
    assert report.real_time_factor < 0.01


def test_error_of_a_scan_is_handed_over(clock):
    errors = []

    def scan() -> None:
        raise ValueError("bench broken")

    ScanTimer(scan, 0.01, errors.append)._run()
    assert [str(error) for error in errors] == ["bench broken"]


def test_report_is_one_line_with_the_figures(clock):
    report, _ = paced(clock, lambda number: 0.0001, 100)
    assert str(report) == (
        "100 scans, real-time factor 1.0000, lateness p50 0.00 p99 0.00 max 0.00 ms, "
        "scan mean 100 max 100 us, lost 0 ms"
    )
