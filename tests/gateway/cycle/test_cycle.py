"""The tick against the emulated PLC, in virtual time: start, run, end, and replay."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.cycle import cycle
from gateway.cycle.supervisor import State
from gateway.errors import ConfigError
from gateway.reasons import Reason
from register_maps import load
from register_maps.signals import Control, Mode, Status
from register_maps.timing import SCAN
from tests.gateway.closed_loop import ClosedLoop
from tests.gateway.cycle.disturbances import CONFIG, again, fault, frozen, left_run_after


def test_it_begins_in_shadow_and_writes_nothing_before_armed(idle):
    idle.run(0.1)
    states = [output.state for output in idle.outputs]
    assert states[:3] == [State.CONNECT, State.SHADOW, State.ARMED]
    assert all(output.setpoint is None for output in idle.outputs[:2])


def test_armed_holds_enable_off_at_standstill(idle):
    idle.run(0.2)
    written = idle.last.setpoint
    assert (written.control, written.mode) == (Control(0), Mode.READY)
    assert (written.speed_setpoint, written.speed_rate) == (0.0, 0.0)


def test_shadow_computes_and_never_writes():
    loop = ClosedLoop(CONFIG, shadow=True)
    loop.run(0.2)
    loop.operate(remote=True)
    loop.run(0.2)
    assert {output.state for output in loop.outputs[1:]} == {State.SHADOW}
    assert all(output.setpoint is None for output in loop.outputs)
    assert loop.last.demand is not None


def test_remote_that_is_on_from_the_beginning_starts_nothing(idle):
    idle.operate(remote=True)
    idle.run(0.5)
    assert idle.last.state is State.ARMED


def test_the_command_block_carries_limits_watchdog_and_map_version(idle):
    idle.run(0.2)
    written = idle.last.setpoint
    assert written.ramp_limit == pytest.approx(3000.0 * np.pi / 30.0)
    assert (written.current_limit, written.watchdog_timeout) == (72.0, 0.2)
    assert written.map_version == idle.map.version


def test_every_write_has_the_next_number_and_heartbeat(idle):
    idle.run(0.2)
    numbers = [out.setpoint.command_sequence for out in idle.outputs if out.setpoint]
    beats = [out.setpoint.gateway_heartbeat for out in idle.outputs if out.setpoint]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers))) == beats


def test_numbers_wrap_with_the_register(idle):
    idle.run(0.1)
    before = replace(idle.state.command, number=65535, unanswered=65536)
    idle.state = replace(idle.state, command=before)
    idle.run(SCAN)
    assert idle.last.setpoint.command_sequence == 0


def test_the_first_number_follows_the_last_one_that_the_plc_has_seen_and_the_moment(idle):
    """ARMED is the third tick, at 33 ms: 41 + 1 + 33000 mod 30011."""
    idle.disturb = lambda _, reading: replace(reading, command_sequence_echo=41)
    idle.run(0.1)
    first = next(output.setpoint for output in idle.outputs if output.setpoint)
    assert first.command_sequence == 3031


@pytest.mark.parametrize("measured", [0.0, 12.5, 200.0])
@pytest.mark.parametrize("name", ["thesis", "compensated"])
def test_the_first_setpoint_of_a_run_is_the_measured_speed(name, measured):
    loop = ClosedLoop(CONFIG.with_values({"regulator.name": name}))
    loop.disturb = lambda _, reading: replace(
        reading, motor_speed=measured, drum_speed=measured / 62.6
    )
    loop.run(0.2)
    loop.operate(remote=True)
    loop.run(0.03)
    first = next(output.setpoint for output in loop.outputs if output.state is State.RUN)
    assert first.speed_setpoint == measured
    assert Control.ENABLE in first.control


def test_without_confirmation_the_start_is_given_up_after_one_second(idle):
    idle.run(0.2)
    idle.disturb = lambda _, reading: replace(
        reading, status=reading.status & ~(Status.ENABLED | Status.ROAD_LOAD)
    )
    idle.operate(remote=True)
    idle.run(0.05)
    assert idle.last.state is State.RUN
    waited = left_run_after(idle, within=1.2)
    assert waited == pytest.approx(1.0, abs=0.08)
    assert idle.last.reason is Reason.NOT_CONFIRMED


def test_taking_remote_away_ramps_down_and_ends_in_safe(running):
    running.operate(remote=False)
    assert left_run_after(running) < 0.03
    assert running.last.reason is Reason.REMOTE_OFF
    running.run(3.0)
    assert running.last.state is State.SAFE
    assert running.last.reason is Reason.REMOTE_OFF
    assert running.last.setpoint.control == Control(0)
    assert running.last.setpoint.speed_setpoint == 0.0


def test_the_rampdown_falls_from_the_last_setpoint_at_rate_down(running):
    last = running.last.setpoint.speed_setpoint
    running.stop_requested = True
    left_run_after(running)
    falling = [running.last.setpoint.speed_setpoint]
    while running.run(SCAN).state is State.RAMPDOWN:
        falling.append(running.last.setpoint.speed_setpoint)
        assert Control.ENABLE in running.last.setpoint.control
    steps = np.diff(falling)
    assert falling[0] == pytest.approx(last, abs=4.0)
    assert steps[:-1] == pytest.approx(-3000.0 * np.pi / 30.0 * SCAN)
    assert falling[-1] == 0.0


def test_a_requested_stop_ramps_down_goes_safe_and_off(running):
    running.stop_requested = True
    running.run(3.0)
    states = list(dict.fromkeys(output.state for output in running.outputs))
    assert states[-3:] == [State.RAMPDOWN, State.SAFE, State.OFF]
    assert running.last.reason is Reason.STOP_REQUESTED
    safe = next(output for output in running.outputs if output.state is State.SAFE)
    assert safe.setpoint.control == Control(0)


def test_without_a_sample_the_setpoint_goes_on_for_two_periods_and_then_waits(running):
    begin, slope = running.last.setpoint.speed_setpoint, running.last.setpoint.speed_rate
    assert slope > 10.0
    running.disturb = again
    steps = [running.run(SCAN).setpoint.speed_setpoint - begin for _ in range(4)]
    assert steps == pytest.approx([0.01 * slope, 0.02 * slope, 0.02 * slope, 0.02 * slope])


def test_nothing_is_written_that_breaks_a_limit(running):
    running.run(24.0)
    speeds = np.array([out.setpoint.speed_setpoint for out in running.outputs if out.setpoint])
    assert speeds.min() >= 0.0
    assert speeds.max() <= 4830.0 * np.pi / 30.0
    assert np.abs(np.diff(speeds)).max() <= 3000.0 * np.pi / 30.0 * SCAN * (1.0 + 1e-9)


def test_the_same_observations_give_the_same_outputs(running):
    running.disturb = fault(Reason.TIMEOUT)
    running.run(1.0)
    state, again = cycle.initial(running.config, running.map), []
    for seen in running.observations:
        state, output = cycle.step(running.config, running.map, state, seen)
        again.append(output)
    assert again == running.outputs


def test_a_map_without_the_torque_that_is_configured_is_refused():
    bench = load("bench_int16")
    kept = tuple(one for one in bench.registers if one.signal != "shaft_torque_integral")
    with pytest.raises(ConfigError, match=r"shaft_torque_integral.*averaged or instantaneous"):
        cycle.initial(CONFIG, replace(bench, registers=kept))


def test_age_counts_from_the_last_sample_that_moved(idle):
    assert idle.run(0.1).age == 0.0
    idle.disturb = frozen
    idle.run(0.01)
    idle.run(0.05)
    assert idle.last.age == pytest.approx(0.05)
