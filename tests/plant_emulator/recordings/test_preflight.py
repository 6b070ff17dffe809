"""Logs that are not what they should be are told by name, or used rightly."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.errors import LogError
from plant_emulator.recordings.preflight import preflight
from plant_emulator.signals.log import Array, Log

RATIO = 62.6
Reader = Callable[[str], Log]


@pytest.fixture
def good(bench_log: Reader) -> Log:
    """A sound log with noise."""
    log = bench_log("bench_practice/practice_002/program1")
    return Log(log.time, log.signals, "run.csv")


def with_channel(log: Log, name: str, values: Array) -> Log:
    """The log with another course of one channel."""
    return Log(log.time, {**log.signals, name: values}, log.source)


def part(log: Log, keep: Array) -> Log:
    """The samples of a log that are kept."""
    return Log(log.time[keep], {n: v[keep] for n, v in log.signals.items()}, log.source)


def refusal(log: Log) -> str:
    """What a log is refused with."""
    with pytest.raises(LogError) as error:
        preflight(log, RATIO)
    return str(error.value)


@pytest.mark.parametrize("case", ["002", "003", "004", "008"])
@pytest.mark.parametrize("program", [1, 2, 3])
def test_sound_log_is_used_whole(bench_log: Reader, case: str, program: int) -> None:
    checked = preflight(bench_log(f"bench_practice/practice_{case}/program{program}"), RATIO)
    assert checked.notes == ()
    assert all(use.all() for use in checked.use.values())


@pytest.mark.parametrize("program", ["1", "2", "3", "4", "6", "6L"])
def test_log_without_noise_is_used_whole(bench_log: Reader, program: str) -> None:
    checked = preflight(bench_log(f"bench_nominal/program{program}"), RATIO)
    assert checked.notes == ()
    assert all(use.all() for use in checked.use.values())


def test_torque_of_the_wrong_sign_is_told(good: Log) -> None:
    flipped = with_channel(good, "shaft_torque", -good["shaft_torque"])
    assert refusal(flipped).startswith("run.csv: shaft_torque_Nm is +12.9 while the motor drives")


@pytest.mark.parametrize("factor", [-1.0, 1000.0])
def test_current_of_the_wrong_sign_or_unit_is_told(good: Log, factor: float) -> None:
    wrong = with_channel(good, "armature_current", factor * good["armature_current"])
    assert "check its sign and unit" in refusal(wrong)


def test_drum_speed_in_rpm_is_told(good: Log) -> None:
    rpm = with_channel(good, "drum_speed", good["drum_speed"] * 60 / (2 * np.pi))
    assert "drum_speed_rad_s is 9.57 times motor_speed_rad_s / 62.6" in refusal(rpm)


def test_drum_speed_of_the_wrong_sign_is_told(good: Log) -> None:
    assert "check the units and signs" in refusal(
        with_channel(good, "drum_speed", -good["drum_speed"])
    )


def test_long_hole_is_refused_and_a_short_one_told(good: Log) -> None:
    index = np.arange(len(good.time))
    hole = refusal(part(good, (index < 700) | (index >= 930)))
    assert hole.startswith("run.csv: no samples from 6.990 s to 9.300 s; cut the log there")
    checked = preflight(part(good, (index < 700) | (index >= 730)), RATIO)
    assert checked.notes[0].startswith("run.csv: 1 holes, the first at 6.990 s")


def test_run_that_starts_in_motion_is_refused(good: Log) -> None:
    moving = refusal(part(good, np.arange(len(good.time)) > 400))
    assert "motor_speed_rad_s starts at 262.8; a run must start at rest" in moving


def test_run_that_does_not_move_is_refused(good: Log) -> None:
    assert "moves by" in refusal(part(good, np.arange(len(good.time)) < 60))


def test_slow_log_is_refused(good: Log) -> None:
    assert "a sample every 1 s" in refusal(part(good, np.arange(len(good.time)) % 100 == 0))


@pytest.mark.parametrize("period", [2, 5])
def test_held_channel_counts_where_it_is_fresh(good: Log, period: int) -> None:
    index = np.arange(len(good.time))
    held = good["drum_speed"][index // period * period]
    checked = preflight(with_channel(good, "drum_speed", held), RATIO)
    assert "drum_speed_rad_s is slower than the log and held" in checked.notes[0]
    stale = index % period != 0
    assert not (checked.use["drum_speed"] & stale & (np.diff(held, prepend=np.nan) == 0)).any()
    assert checked.use["motor_speed"].all()


@pytest.mark.parametrize("quantum", [2.0, 3.0])
def test_coarse_channel_counts_everywhere(good: Log, quantum: float) -> None:
    """Rounding repeats more than half of the values, but it holds none: each is measured anew."""
    noise = {"drum_speed": 0.01, "armature_current": 0.25, "shaft_torque": 0.25}
    coarse = good
    for name, deviation in noise.items():
        step = quantum * deviation
        coarse = with_channel(coarse, name, np.round(good[name] / step) * step)
    checked = preflight(coarse, RATIO)
    assert not any("held" in note for note in checked.notes)
    for name in noise:
        assert np.mean(np.diff(coarse[name]) == 0.0) > 0.4
        assert np.mean(checked.use[name]) > 0.97


def test_frozen_stretch_is_left_out_and_nothing_else(good: Log) -> None:
    current = good["armature_current"].copy()
    current[500:560] = current[500]
    checked = preflight(with_channel(good, "armature_current", current), RATIO)
    assert "armature_current_A stands still, first at 5.010 s" in checked.notes[0]
    assert list(np.flatnonzero(~checked.use["armature_current"])) == list(range(501, 560))


def test_stretch_at_the_end_of_the_range_is_left_out(good: Log) -> None:
    clipped = np.maximum(good["shaft_torque"], -15.0)
    checked = preflight(with_channel(good, "shaft_torque", clipped), RATIO)
    assert "shaft_torque_Nm is at the end of its range" in checked.notes[0]
    left_out = ~checked.use["shaft_torque"]
    assert not (left_out & (clipped > -15.0)).any()
    assert left_out.sum() > 0.9 * (clipped == -15.0).sum()


def test_channel_frozen_for_most_of_the_run_is_refused(good: Log) -> None:
    current = good["armature_current"].copy()
    current[600:] = current[600]
    assert "armature_current_A" in refusal(with_channel(good, "armature_current", current))


def test_missing_current_is_told(good: Log) -> None:
    without = {n: v for n, v in good.signals.items() if n != "armature_current"}
    checked = preflight(Log(good.time, without, good.source), RATIO)
    assert "without armature_current_A the flux (K_1, K_2)" in checked.notes[0]
