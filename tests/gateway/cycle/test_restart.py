"""A PLC that restarts, in each state, with and without readings: nothing starts unasked.

A PLC takes enable for a rising edge when the first command after its start has it. The emulated PLC
does so as well, with remote still on.
"""

from dataclasses import replace
from pathlib import Path

import pytest

import register_maps
from gateway.configuration.config import Config
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from register_maps.signals import Control, PlcState, Status
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop, undisturbed

CONFIG = Config()


@pytest.fixture(scope="module")
def driving():
    loop = ClosedLoop(CONFIG)
    loop.start()
    loop.run(4.5)
    assert loop.drum_speed[-1] > 1.0
    return loop


@pytest.fixture
def running(driving):
    return driving.branch()


def restart(loop):
    """Restart the PLC: it forgets the command block, the switches stay as they are."""
    loop.plc.restart()
    loop.words = None


def nothing_starts(loop, duration=4.0):
    """Run on; the PLC enters no state that drives the bench, and no block has enable."""
    first, drum = len(loop.outputs), loop.drum_speed[-1]
    for _ in range(round(duration / SCAN)):
        loop.run(SCAN)
        assert loop.plc.state not in (PlcState.SPEED, PlcState.ROAD_LOAD)
    written = [output.setpoint for output in loop.outputs[first:] if output.setpoint]
    assert not any(block.control & Control.ENABLE for block in written)
    assert max(loop.drum_speed[first:]) <= drum + 0.2
    assert loop.drum_speed[-1] == pytest.approx(0.0, abs=0.05)


def test_restart_in_run_ends_it_with_its_reason_and_starts_nothing(running):
    restart(running)
    running.run(2 * SCAN)
    assert (running.last.state, running.last.reason) == (State.RAMPDOWN, Reason.PLC_RESTARTED)
    nothing_starts(running)
    assert (running.last.state, running.last.reason) == (State.SAFE, Reason.PLC_RESTARTED)


def driving_by_a_clock_of(span, register_map="bench_int16"):
    """A loop in RUN whose clock starts again at 0 s of its span in 1 s [s]."""
    loop = ClosedLoop(CONFIG, map_name=register_map)
    loop.disturb = lambda _, reading: replace(reading, plc_time=(reading.plc_time - 5.9) % span)
    loop.start()
    loop.run(4.5)
    assert loop.drum_speed[-1] > 1.0
    assert span - loop.observations[-1].measurement.plc_time == pytest.approx(1.0, abs=0.03)
    return loop


def test_clock_that_wraps_at_the_end_of_its_register_does_not_end_a_run():
    """32 bits of 0.1 ms."""
    loop = driving_by_a_clock_of(2.0**32 * 1e-4)
    loop.run(2.0)
    assert loop.observations[-1].measurement.plc_time < 1.1
    assert (loop.last.state, loop.last.reason) == (State.RUN, None)


def test_clock_that_starts_again_at_midnight_as_its_map_says_does_not_end_a_run(tmp_path):
    text = Path(register_maps.__file__).with_name("bench_int16.toml").read_text()
    daily = tmp_path / "daily.toml"
    daily.write_text(text.replace("range = [0, 429496729.5]", "range = [0, 86399999.9]"))
    loop = driving_by_a_clock_of(86400.0, str(daily))
    loop.run(2.0)
    assert loop.observations[-1].measurement.plc_time < 1.1
    assert (loop.last.state, loop.last.reason) == (State.RUN, None)


def test_clock_that_starts_again_against_its_map_ends_a_run_as_a_restart_does():
    """The map says that it counts on to the end of the register."""
    loop = driving_by_a_clock_of(86400.0)
    loop.run(0.9)
    assert loop.last.state is State.RUN
    loop.run(0.2)
    assert (loop.last.state, loop.last.reason) == (State.RAMPDOWN, Reason.PLC_RESTARTED)
    loop.run(4.0)
    assert (loop.last.state, loop.last.reason) == (State.SAFE, Reason.PLC_RESTARTED)


def test_restart_in_the_rampdown_starts_nothing(running):
    running.stop_requested = True
    running.run(0.3)
    assert running.last.state is State.RAMPDOWN
    assert Control.ENABLE in running.last.setpoint.control
    restart(running)
    nothing_starts(running)


def test_restart_in_safe_starts_nothing(running):
    running.operate(remote=False)
    running.run(3.0)
    running.operate(remote=True)
    restart(running)
    nothing_starts(running)


@pytest.mark.parametrize("lost", [Reason.TIMEOUT, Reason.CONNECTION_LOST, Reason.EXCEPTION_6])
@pytest.mark.parametrize("before", [0.0, 0.02, 0.05, 0.08, 0.5])
@pytest.mark.parametrize("after", [0.0, 0.02, 0.3])
def test_restart_hidden_by_lost_readings_starts_nothing(running, lost, before, after):
    """Writes still arrive while readings fail."""
    running.disturb = lambda _, reading: lost
    running.run(before)
    restart(running)
    if after:
        running.run(after)
    running.disturb = undisturbed
    nothing_starts(running)


def test_restart_while_the_start_waits_for_its_confirmation_starts_nothing():
    loop = ClosedLoop(CONFIG)
    loop.run(0.2)
    loop.operate(remote=True)
    loop.run(SCAN)
    assert loop.last.state is State.RUN
    restart(loop)
    nothing_starts(loop)


def test_remote_that_a_booting_plc_shows_late_is_no_wish_of_the_operator():
    """For 0.3 s after its start the PLC has not read its inputs: remote shows as off."""
    loop = ClosedLoop(CONFIG)
    loop.operate(remote=True)
    loop.run(0.5)
    assert loop.last.state is State.ARMED
    restart(loop)
    loop.disturb = lambda _, reading: (
        reading
        if reading.plc_time > 0.3
        else type(reading)(**{**vars(reading), "status": reading.status & ~Status.REMOTE})
    )
    loop.run(5.0)
    assert loop.last.state is State.ARMED
    assert State.RUN not in {output.state for output in loop.outputs}


def test_without_enable_the_plc_ramps_down_at_the_slope_of_the_rampdown():
    """1000 rpm/s = 104.72 rad/s^2, although a setpoint may rise faster."""
    loop = ClosedLoop(CONFIG.with_values({"limits.rate_down_rpm_s": "1000"}))
    loop.start()
    loop.run(4.5)
    loop.disturb = lambda _, reading: Reason.TIMEOUT
    loop.run(0.5)
    assert loop.last.setpoint.control == Control(0)
    assert loop.last.setpoint.ramp_limit == pytest.approx(104.7198)


def test_run_goes_on_over_lost_readings_without_a_block_in_their_ticks(running):
    first = len(running.outputs)
    running.disturb = lambda loop, reading: Reason.TIMEOUT if loop.plc.scans % 10 < 5 else reading
    running.run(2.0)
    assert running.last.state is State.RUN
    for seen, output in zip(running.observations[first:], running.outputs[first:], strict=True):
        assert (seen.measurement is None) == (output.setpoint is None)
