"""Simulations that are led along the speeds of a log of the independent bench."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.sensors import Sensor
from plant_emulator.recordings.recording import recording
from plant_emulator.signals.log import Log
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.simulate import MeasuredSpeeds, simulate
from plant_emulator.simulation.start_in_gap import mean_square_residual

ReadLog = Callable[[str], Log]
INTERVAL = 0.2


def speeds(log: Log) -> MeasuredSpeeds:
    """The speeds of a log, each sample measured."""
    return MeasuredSpeeds(
        motor_speed=log["motor_speed"],
        drum_speed=log["drum_speed"],
        interval=INTERVAL,
        dead_zones=np.zeros(2),
    )


@pytest.mark.parametrize("program", ["program1", "program2", "program3"])
def test_right_simulation_needs_no_correction(
    nominal: ParameterSet, bench_log: ReadLog, program: str
) -> None:
    """Without noise and gap, free and led simulation are the same within a tenth of the noise."""
    log = bench_log(f"bench_nominal/{program}")
    free = simulate(inputs_of(log), nominal.values())
    led = simulate(inputs_of(log), nominal.values(), along=speeds(log))
    assert mean_square_residual(free, led) < 0.01


def test_contact_comes_in_time_at_wrong_friction(nominal: ParameterSet, bench_log: ReadLog) -> None:
    """Half of the friction moves every contact of a free simulation, and hardly those of a led one.

    The shaft's torque shows contact; friction itself acts between motor and shaft.
    """
    log = bench_log("bench_nominal/program2")
    values = {
        **nominal.values(),
        "gear_coulomb_friction": 0.5 * nominal.value("gear_coulomb_friction"),
    }
    run = inputs_of(log)
    missed = [
        np.abs(log["drum_speed"] - simulate(run, values, along=along)["drum_speed"]).mean()
        for along in (None, speeds(log))
    ]
    assert missed[1] < 0.5 * missed[0]


def coarse(log: Log, step: float) -> Log:
    """The log with a quantised drum speed, of noise that hardly reaches the next step."""
    noisy = log["drum_speed"] + np.random.default_rng(5).normal(0.0, 0.2 * step, len(log.time))
    shown = step * np.round(noisy / step)
    return Log(log.time, {**log.signals, "drum_speed": shown}, log.source)


@pytest.mark.parametrize("step", [0.0, 0.05], ids=["fine", "coarse"])
def test_noise_of_the_speeds_moves_no_contact(
    nominal: ParameterSet, bench_log: ReadLog, step: float
) -> None:
    """Without a dead zone the mean squares are 1.63 for 1.05, and 6.8 for 0.66."""
    log = bench_log("bench_practice/practice_004/program2")
    if step:
        log = coarse(bench_log("bench_nominal/program2"), step)
    run = recording(log)
    free, led = (
        simulate(run.inputs, nominal.values(), along=along)
        for along in (None, run.measured_speeds(INTERVAL))
    )
    assert mean_square_residual(run.log, led) < 1.01 * mean_square_residual(run.log, free)


def test_dead_zone_is_the_noise_or_half_a_step(bench_log: ReadLog) -> None:
    """Motor speeds differ by less than their noise, and the drum's are 0.05 rad/s apart."""
    run = recording(bench_log("bench_practice/practice_004/program2"))
    names = ("motor_speed", "drum_speed")
    noise = [run.noise[run.channels.index(name)] for name in names]
    assert run.measured_speeds(INTERVAL).dead_zones == pytest.approx(noise)
    steps = recording(coarse(run.log, 0.05)).measured_speeds(INTERVAL).dead_zones
    assert steps == pytest.approx([noise[0], 0.025], rel=1e-6)


@pytest.mark.parametrize("channel", ["motor_speed", "drum_speed"])
def test_declared_lag_of_a_speed_needs_no_correction(
    nominal: ParameterSet, bench_log: ReadLog, channel: str
) -> None:
    """A speed of 8 rad/s^2 that is shown 0.05 s late would be corrected by 0.4 rad/s."""
    sensors = {channel: Sensor(time_constant=0.05)}
    run = inputs_of(bench_log("bench_nominal/program2"), sensors=sensors)
    free = simulate(run, nominal.values())
    led = simulate(run, nominal.values(), along=speeds(free))
    assert mean_square_residual(free, led) < 0.5


def test_channel_without_a_sample_that_counts_leads_nothing(bench_log: ReadLog) -> None:
    run = recording(bench_log("bench_practice/practice_004/program2"))
    use = run.use.copy()
    use[run.channels.index("drum_speed")] = False
    assert np.isnan(replace(run, use=use).measured_speeds(INTERVAL).drum_speed).all()


def test_samples_that_are_not_measured_correct_nothing(
    nominal: ParameterSet, bench_log: ReadLog
) -> None:
    log = bench_log("bench_nominal/program1")
    none = np.full(len(log.time), np.nan)
    along = replace(speeds(log), motor_speed=none, drum_speed=none)
    free = simulate(inputs_of(log), nominal.values(), gap_position=0.5)
    led = simulate(inputs_of(log), nominal.values(), gap_position=0.5, along=along)
    assert mean_square_residual(free, led) < 1e-4


def test_spikes_and_masked_samples_lead_nothing_astray(bench_log: ReadLog) -> None:
    run = recording(bench_log("bench_practice/practice_004/program2"))
    log = run.log
    spoilt = log["drum_speed"].copy()
    spoilt[200] = 100.0
    use = run.use.copy()
    use[run.channels.index("drum_speed"), 500:600] = False
    damaged = replace(
        run, log=Log(log.time, {**log.signals, "drum_speed": spoilt}, log.source), use=use
    )
    found = damaged.measured_speeds(INTERVAL).drum_speed
    assert np.isnan(found[500:600]).all()
    kept = np.r_[0:500, 600 : len(log.time)]
    assert np.abs(found[kept] - log["drum_speed"][kept]).max() < 0.1
