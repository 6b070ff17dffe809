"""Drive programs: what the limits would clip, repeats, and the run against the emulated PLC."""

from math import pi

import numpy as np
import pytest

from gateway.commissioning.drive import Point, configure_program, program_of
from gateway.configuration.config import Config, from_document
from gateway.configuration.program import Profile, Ramp
from gateway.cycle.supervisor import State
from gateway.errors import ConfigError
from gateway.workflows.drive import read_program
from gateway.workflows.live_program import Progress
from register_maps.logs.drive_programs import DRIVE_PROGRAMS
from register_maps.signals import Mode
from tests.gateway.closed_loop import ClosedLoop

RPM = 2.0 * pi / 60.0


def points(*pairs: tuple[float, float]) -> list[Point]:
    return [Point(time=time, speed=speed * RPM) for time, speed in pairs]


def refused(pairs: list[Point], **values: str) -> str:
    config = Config().with_values({f"limits.{key}": value for key, value in values.items()})
    with pytest.raises(ConfigError) as error:
        configure_program(config, program_of("test", pairs))
    return str(error.value)


def test_dwells_delay_what_follows_and_repeats_follow_each_other():
    """0 -> 300 rpm in 2 s, held 3 s, back in 1 s: one pass takes 6 s, two take 12 s."""
    corners = [
        Point(time=0.0, speed=0.0),
        Point(time=2.0, speed=300.0, dwell=3.0),
        Point(time=3.0, speed=0.0),
    ]
    (step,) = program_of("test", corners, repeats=2).steps
    assert isinstance(step, Profile)
    assert step.times == (0.0, 2.0, 5.0, 6.0, 8.0, 11.0, 12.0)
    assert step.speeds == (0.0, 300.0, 300.0, 0.0, 300.0, 300.0, 0.0)


def test_a_program_that_ends_moving_is_followed_by_a_ramp_to_standstill():
    program = read_program("program2")
    assert program.steps[-1] == Ramp(speed=0.0, rate=pytest.approx(300.0 * RPM), hold=0.0)
    assert program.duration == pytest.approx(25.0 + 375.0 / (300.0 * RPM))


@pytest.mark.parametrize("name", ["program1", "program2", "program3"])
def test_programs_of_the_thesis_pass_the_usual_limits(name):
    config = configure_program(Config(), read_program(name))
    assert from_document(config.document) == config


def test_program_4_steps_faster_than_the_usual_slope_and_says_so():
    """50 rad/s in 80 ms are 5968 rpm/s; the lag is the whole step of 477 rpm."""
    with pytest.raises(ConfigError, match=r"46\.00 s: .*slope.*5968 rpm/s.*rate_up_rpm_s = 3000"):
        configure_program(Config(), read_program("program4"))
    rates = {"limits.rate_up_rpm_s": "6000", "limits.rate_down_rpm_s": "6000"}
    with pytest.raises(ConfigError, match=r"lag of the bench.*477 rpm.*deviation_rpm = 400"):
        configure_program(Config().with_values(rates), read_program("program4"))
    configure_program(
        Config().with_values({**rates, "limits.deviation_rpm": "500"}), read_program("program4")
    )


def test_points_of_program_4_hold_its_sine_to_a_thousandth():
    """Linear points every 10 ms under a sine of 25 rad/s and 0.9 Hz: 25 (2 pi 0.9)^2 / 8 1e-4."""
    known = DRIVE_PROGRAMS["program4"]
    fine = dict(known.points(0.001))
    times, speeds = zip(*known.points(0.01), strict=True)
    between = np.interp(list(fine), times, speeds)
    assert np.abs(between - list(fine.values())).max() < 0.012


def test_what_would_be_clipped_is_named_with_its_limit():
    assert "speed, found '2000 rpm'; expected 0 .. limits.speed_max_rpm = 1500" in refused(
        points((0, 0), (10, 2000), (20, 0)), speed_max_rpm="1500"
    )
    assert "slope, found '-200 rpm/s'; expected 0 .. limits.rate_down_rpm_s = 100" in refused(
        points((0, 0), (10, 1000), (15, 0)), rate_down_rpm_s="100"
    )
    assert "speed, found '-100 rpm'" in refused(points((0, 0), (1, -100), (2, 0)))


@pytest.mark.parametrize(
    ("corners", "repeats", "match"),
    [
        ([Point(time=0.0, speed=0.0)], 1, "two points or more"),
        (points((0, 0), (4, 1), (3, 0)), 1, "point 3: .* found '3 s'; expected more than 4 s"),
        ([Point(time=0.0, speed=9.0), Point(time=1.0, speed=0.0)], 1, "stands at the start"),
        ([Point(time=0.0, speed=0.0), Point(time=1.0, speed=9.0)], 2, "repeated has to end at"),
    ],
)
def test_points_that_give_no_program_are_refused(corners, repeats, match):
    with pytest.raises(ConfigError, match=match):
        program_of("test", corners, repeats)


@pytest.mark.slow
def test_the_plc_drives_what_was_asked_for_and_the_run_ends_by_itself():
    program = program_of("test", points((0, 0), (0.5, 0), (2.5, 600), (4, 600), (5, 300), (6, 0)))
    loop, progress = ClosedLoop(configure_program(Config(), program)), Progress()
    loop.run(0.2)
    loop.operate(remote=True)
    reference, began = [], None
    while not progress(loop.last):
        loop.run(0.01)
        if loop.last.state is State.RUN and loop.plc.inbox.command.mode is Mode.SPEED:
            began = loop.plc.time if began is None else began
            reference.append((loop.plc.time - began, loop.plc.path[-1]))
    assert progress.done
    times, speeds = np.array(reference).T
    corners = np.array([(0.5, 0), (2.5, 600), (4, 600), (5, 300), (6, 0)])
    late = np.array([0.0, 0.01, 0.02, 0.03, 0.04])
    errors = [
        np.abs(speeds - np.interp(times - one, corners[:, 0], corners[:, 1] * RPM)).max()
        for one in late
    ]
    assert min(errors) < 1.0
    assert times[-1] == pytest.approx(6.0, abs=0.1)
