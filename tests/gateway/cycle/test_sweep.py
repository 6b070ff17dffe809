"""The sweep of steady speeds: in the tick against the emulated PLC, and what is refused before."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from gateway.configuration.config import Config, from_document
from gateway.cycle.supervisor import State
from gateway.errors import ConfigError
from gateway.losses.live import sweep_config
from gateway.reasons import Reason
from gateway.workflows.live_program import Progress
from register_maps.signals import Mode, PlcState, Status
from tests.gateway.closed_loop import ClosedLoop

RPM = 2.0 * pi / 60.0
SPEEDS = [200.0, 400.0, 300.0, 600.0]


def started(config: Config) -> ClosedLoop:
    loop = ClosedLoop(config)
    loop.start()
    return loop


@pytest.mark.slow
def test_each_speed_is_held_for_its_time_one_after_the_other():
    loop = started(sweep_config(Config(), SPEEDS, hold=4.0))
    loop.run(40.0)
    setpoints = np.array([one.setpoint.speed_setpoint for one in loop.outputs if one.setpoint])
    for speed in SPEEDS:
        held = np.count_nonzero(np.abs(setpoints - speed * RPM) < 1e-9) * 0.01
        assert held == pytest.approx(4.0, abs=0.05)
    steps = np.abs(np.diff(setpoints))
    assert steps.max() <= 300.0 * RPM * 0.01 * 1.01
    assert loop.last.setpoint.speed_setpoint == 0.0


def test_duration_is_that_of_holds_and_ramps():
    """4 holds of 4 s; 200 + 200 + 100 + 300 + 600 rpm at 300 rpm/s."""
    config = sweep_config(Config(), SPEEDS, hold=4.0)
    assert config.program.duration == pytest.approx(16.0 + 1400.0 / 300.0)
    loop, progress = started(config), Progress()
    before = len(loop.outputs)
    while not progress(loop.last):
        loop.run(0.01)
    assert (len(loop.outputs) - before) * 0.01 == pytest.approx(config.program.duration, abs=0.3)
    assert progress.done


def test_the_plc_is_in_mode_speed_so_that_nobody_drives_the_truck():
    loop = started(sweep_config(Config(), SPEEDS, hold=4.0))
    loop.run(6.0)
    assert loop.last.setpoint.mode is Mode.SPEED
    assert loop.plc.state is PlcState.SPEED
    assert set(loop.wheel_torque) == {0.0}
    assert loop.last.state is State.RUN


def test_a_plc_that_goes_into_road_load_ends_the_sweep():
    loop = started(sweep_config(Config(), SPEEDS, hold=4.0))
    loop.disturb = lambda _, seen: replace(seen, status=seen.status | Status.ROAD_LOAD)
    loop.run(0.05)
    assert loop.last.state in (State.RAMPDOWN, State.SAFE)
    assert loop.last.reason is Reason.PLC_LEFT


def test_the_operator_ends_it_by_a_ramp_down_and_it_is_not_done():
    config = sweep_config(Config(), SPEEDS, hold=4.0)
    loop, progress = started(config), Progress()
    loop.run(3.0)
    assert not progress(loop.last)
    loop.operate(remote=False)
    loop.run(0.05)
    assert loop.last.reason is Reason.REMOTE_OFF
    assert progress(loop.last)
    assert not progress.done


def test_the_limits_have_the_last_word():
    limited = {"limits.rate_up_rpm_s": "100", "limits.speed_max_rpm": "600"}
    loop = started(sweep_config(Config().with_values(limited), SPEEDS, hold=4.0))
    loop.run(12.0)
    setpoints = np.array([one.setpoint.speed_setpoint for one in loop.outputs if one.setpoint])
    assert np.diff(setpoints).max() <= 100.0 * RPM * 0.01 * 1.01


def test_usual_speeds_stay_under_the_limit():
    config = sweep_config(Config().with_values({"limits.speed_max_rpm": "3000"}), None, None)
    assert [round(step.speed / RPM) for step in config.program.steps] == [
        *(200, 400, 800, 1400, 2100, 2900),
        0,
    ]


def test_a_configuration_with_a_sweep_survives_its_document():
    config = sweep_config(Config(), SPEEDS, hold=4.0)
    assert from_document(config.document) == config
    assert Config().program is None


@pytest.mark.parametrize(
    ("speeds", "hold", "match"),
    [
        ([200.0, 400.0, 800.0], None, "--speeds: speeds that do not determine the friction"),
        ([200.0, 202.0, 204.0, 800.0], None, "do not determine.*at least 4"),
        ([1000.0, 1200.0, 1400.0, 1600.0], None, "the fastest at least 2.5 times the slowest"),
        ([200.0, 400.0, 800.0, 5000.0], None, r"sweep\.speeds_rpm: bad value.*5000"),
        ([200.0, 400.0, 800.0, 4000.0], None, r"4000.*at most limits\.speed_max_rpm = 3600"),
        ([-200.0, 400.0, 800.0, 1600.0], None, r"sweep\.speeds_rpm: bad value.*-200.*60 \.\. 4830"),
        (SPEEDS, 1.0, r"sweep\.hold_s: bad value.*1\.0.*3 \.\. 3600"),
        ([200.0, float("nan"), 400.0, 800.0, 1600.0], None, "bad value.*nan"),
    ],
)
def test_a_sweep_that_tells_nothing_is_refused_before_anything_turns(speeds, hold, match):
    with pytest.raises(ConfigError, match=match):
        sweep_config(Config().with_values({"limits.speed_max_rpm": "3600"}), speeds, hold)


@pytest.mark.parametrize("table", [3, {}, {"speeds_rpm": 3, "hold_s": 8, "rate_rpm_s": 300}])
def test_a_broken_table_is_named(table):
    with pytest.raises(ConfigError, match=r"sweep.*found.*expected a (table|list)"):
        from_document({"sweep": table})
