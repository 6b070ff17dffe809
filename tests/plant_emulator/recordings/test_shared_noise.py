"""A sensor has one noise in all logs: what moves from sample to sample in one of them is none."""

from collections.abc import Callable

import numpy as np
import pytest

from plant_emulator.recordings.recording import recording
from plant_emulator.recordings.shared_noise import with_shared_noise
from plant_emulator.signals.log import Log
from plant_emulator.simulation.sensor_noise import SENSORS, add_noise

BenchLog = Callable[[str], Log]


def changed(log: Log, **signals: np.ndarray) -> Log:
    return Log(log.time, {**log.signals, **signals}, log.source)


def test_a_log_that_moves_from_sample_to_sample_has_the_noise_of_the_others(
    bench_log: BenchLog,
) -> None:
    first, second, third = (
        add_noise(bench_log(f"bench_nominal/program{k}"), seed)
        for k, seed in ((1, 1), (2, 2), (3, 3))
    )
    restless = np.random.default_rng(4).choice((-1.0, 1.0), len(first.time))
    first = changed(first, armature_current=first["armature_current"] + restless)
    loaded = [recording(log) for log in (first, second, third)]
    row = loaded[0].channels.index("armature_current")
    assert loaded[0].noise[row] > 3.0 * loaded[1].noise[row]
    for one in with_shared_noise(loaded):
        for name, level in zip(one.channels, one.noise, strict=True):
            assert level == pytest.approx(SENSORS[name][0], rel=0.05), name


def test_a_coarse_channel_that_stands_still_does_not_tell_the_noise(bench_log: BenchLog) -> None:
    """By hand: sensor and quantiser together make sqrt(s^2 + q^2 / 12)."""
    log, step = add_noise(bench_log("bench_nominal/program3"), 1), 0.5
    torque = np.round(log["shaft_torque"] / step) * step
    still = changed(log, shaft_torque=np.where(log.time < 5.0, torque, 0.0))
    loaded = [recording(one) for one in (changed(log, shaft_torque=torque), still)]
    row = loaded[0].channels.index("shaft_torque")
    assert loaded[1].noise[row] < 0.1
    level = with_shared_noise(loaded)[0].noise[row]
    assert level == pytest.approx(np.hypot(SENSORS["shaft_torque"][0], step / 12.0**0.5), rel=0.05)


def test_a_log_without_noise_tells_nothing_of_the_others(bench_log: BenchLog) -> None:
    exact = bench_log("bench_nominal/program3")
    loaded = [recording(one) for one in (exact, add_noise(exact, 1))]
    for one, before in zip(with_shared_noise(loaded), loaded, strict=True):
        assert one.noise == pytest.approx(before.noise)


def test_held_out_logs_do_not_tell_the_noise_of_the_fitted_ones(bench_log: BenchLog) -> None:
    quiet = add_noise(bench_log("bench_nominal/program3"), 1)
    restless = np.random.default_rng(4).choice((-1.0, 1.0), len(quiet.time))
    loud = changed(quiet, armature_current=quiet["armature_current"] + restless)
    loaded = [recording(one) for one in (loud, quiet)]
    row = loaded[0].channels.index("armature_current")
    first, second = with_shared_noise(loaded, 1)
    assert first.noise[row] == second.noise[row] == pytest.approx(loaded[0].noise[row])


def test_a_slow_sensor_in_a_fast_log_tells_nothing_of_slow_logs(bench_log: BenchLog) -> None:
    """Noise of a lag of 20 ms changes little within 1 ms, and shows as less."""
    slow = add_noise(bench_log("bench_nominal/program3"), 1)
    time = np.arange(slow.time[0], slow.time[-1], 0.001)
    signals = {name: np.interp(time, slow.time, value) for name, value in slow.signals.items()}
    fast = Log(time, signals, "fast.csv")
    loaded = [recording(one) for one in (slow, fast)]
    row = loaded[0].channels.index("shaft_torque")
    assert loaded[1].noise[row] < 0.8 * loaded[0].noise[row]
    for one, before in zip(with_shared_noise(loaded), loaded, strict=True):
        assert one.noise == pytest.approx(before.noise)


def test_a_short_log_that_is_quiet_by_chance_does_not_tell_the_noise_alone(
    bench_log: BenchLog,
) -> None:
    """By hand: 300 samples tell a deviation within 6 %, 5000 within 1.5 %."""
    long = add_noise(bench_log("bench_nominal/program3"), 1)
    cut = slice(1000, 1300)
    part = Log(long.time[cut], {n: v[cut] for n, v in long.signals.items()}, "short.csv")
    loaded = [recording(one) for one in (long, part)]
    chance = [loaded[0], loaded[1].with_noise(0.87 * loaded[0].noise)]
    for one in with_shared_noise(chance):
        assert one.noise == pytest.approx(loaded[0].noise, rel=0.01)
