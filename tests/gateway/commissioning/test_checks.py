"""Evaluations of the checks against motion that can be told by hand."""

import numpy as np
import pytest

from gateway.commissioning.check import Check, missing, page
from gateway.commissioning.checks import acceleration, coast_down, compensation, inertia, response
from gateway.commissioning.readiness import NAMES, readiness_program
from gateway.commissioning.readiness import evaluate as ready
from gateway.commissioning.step_run import StepRun
from gateway.commissioning.verification import CHECKS, evaluate, verification_program
from gateway.configuration.config import Config, from_document
from gateway.configuration.program import Emulation, Program, Ramp
from gateway.errors import ConfigError
from gateway.friction.law import friction_torque
from gateway.losses.sections import SweepTrace

RADIUS, RATIO = 0.645, 62.6
PERIOD = 0.01


def pushed(mass: float, force: float, label: str) -> Emulation:
    return Emulation(
        mass=mass,
        f0=400.0,
        f1=0.0,
        f2=0.0,
        force=force,
        slowest=0.0,
        fastest=9.0,
        longest=99.0,
        label=label,
    )


def run_of(parts: list[tuple[Emulation, np.ndarray]], torque=None) -> StepRun:  # type: ignore[no-untyped-def]
    """Run of these emulations, each with its speeds of the rim [m/s] every 10 ms."""
    speed = np.concatenate([values for _, values in parts])
    steps = np.concatenate([np.full(len(values), k) for k, (_, values) in enumerate(parts)])
    time = np.arange(len(speed)) * PERIOD
    drum = speed / RADIUS
    program = Program(name="test", steps=tuple(step for step, _ in parts))
    return StepRun(
        config=Config().with_program(program),
        trace=SweepTrace(
            name="test",
            time=time,
            motor_speed=drum * RATIO,
            drum_speed=drum,
            shaft_torque=np.zeros_like(time) if torque is None else torque(drum),
        ),
        current=np.full(len(time), np.nan),
        own_time=time,
        heartbeat=np.arange(len(time), dtype=float),
        oil_temperature=np.full(len(time), np.nan),
        steps=steps,
    )


def falling(start: float, end: float, rate: float) -> np.ndarray:
    return np.arange(start, end, -rate * PERIOD)


def test_a_coast_down_at_constant_deceleration_has_the_force_m_a_in_every_interval():
    speed = falling(5.0, 0.9, 0.1)
    time = np.arange(len(speed)) * PERIOD
    forces = coast_down.mean_forces(time, speed, 4000.0, coast_down.SPEED_BOUNDS)
    assert forces == pytest.approx([400.0] * 6, rel=1e-6)


def test_target_of_an_interval_is_the_mean_of_the_road_load_over_its_speeds():
    """F0 + F1 v + F2 v^2 over 1 .. 3 m/s: 10 + 2 * 2 + 3 * 13 / 3 = 27."""
    step = pushed(1.0, 0.0, "x")
    road = Emulation(**{**vars(step), "f0": 10.0, "f1": 2.0, "f2": 3.0})
    assert coast_down.targets(road, np.array([3.0, 1.0])) == pytest.approx([27.0])


def coasts(*rates: float) -> StepRun:
    """Coast-downs of 4000 kg, one after the other, each with its deceleration [m/s^2]."""
    step = pushed(4000.0, 0.0, "coast-down")
    return run_of([(step, falling(5.0, 0.9, rate)) for rate in rates])


def test_a_truck_that_rolls_out_too_fast_by_40_newton_is_outside_and_says_so():
    (found,) = coast_down.evaluate(coasts(0.11, 0.11))
    assert found.value == pytest.approx(40.0, rel=1e-3)
    assert not found.holds
    assert "in none of 2 runs, +10.0 % of 400 N" in found.what


def test_two_coast_downs_in_a_row_within_the_limit_hold_and_their_number_is_told():
    """4000 kg at 0.11, 0.101 and 0.1005 m/s^2 are 40, 4 and 2 N over their 400 N."""
    (found,) = coast_down.evaluate(coasts(0.11, 0.101, 0.1005, 0.11))
    assert found.value == pytest.approx(4.0, rel=1e-2)
    assert found.holds
    assert "in 3 of 4 runs, +1.0 % of 400 N" in found.what


def test_coast_downs_within_the_limit_that_do_not_follow_each_other_do_not_hold():
    (found,) = coast_down.evaluate(coasts(0.1, 0.11, 0.1, 0.11))
    assert not found.holds


@pytest.mark.parametrize("speeds", [[falling(5.0, 0.9, 0.1)], [np.full(2000, 4.6)] * 2])
def test_a_truck_that_does_not_roll_out_twice_is_missing_not_within(speeds):
    (found,) = coast_down.evaluate(
        run_of([(pushed(4000.0, 0.0, "coast-down"), speed) for speed in speeds])
    )
    assert np.isnan(found.value)
    assert not found.holds
    assert found.to_json()["value"] is None


@pytest.mark.parametrize(("repeats", "driven"), [(1, 2), (3, 3), (5, 4)])
def test_each_truck_rolls_out_two_to_four_times(repeats, driven):
    steps = coast_down.steps(Config(), repeats)
    masses = [step.mass for step in steps if isinstance(step, Emulation)]
    assert (
        masses
        == [Config().verification.smallest] * driven + [Config().verification.largest] * driven
    )


def test_force_left_on_the_bare_bench_is_mass_times_deceleration():
    """752 kg that lose 0.01 m/s every second feel 7.52 N."""
    (found,) = compensation.evaluate(
        run_of([(pushed(752.0, 0.0, "compensation"), falling(4.5, 4.2, 0.01))])
    )
    assert found.value == pytest.approx(7.52, rel=1e-3)


def test_acceleration_is_judged_against_force_over_mass():
    """1000 N on 4000 kg ask for 0.25 m/s^2; 0.2525 are 1 % more."""
    rising = np.arange(0.5, 4.5, 0.2525 * PERIOD)
    (found,) = acceleration.evaluate(run_of([(pushed(4000.0, 1000.0, "acceleration"), rising)]))
    assert found.value == pytest.approx(1.0, abs=1e-3)


def test_inertia_of_a_pair_of_runs_does_not_see_an_error_of_the_friction():
    """The bench has 330 kg m^2 and a friction 20 % over the configured one.

    The torque of a window is that of its middle, half a period before its sample.
    """
    rising = np.arange(0.5, 4.5, 0.5 * PERIOD)
    down = rising[::-1]

    def torque(drum: np.ndarray) -> np.ndarray:
        before = np.concatenate((drum[:1], drum[:-1]))
        law = Config().regulator.friction
        friction = np.array([friction_torque(w, law) for w in 0.5 * (drum + before)])
        return -(330.0 * (drum - before) / PERIOD + 1.2 * friction) / RATIO

    parts = [(pushed(4000.0, 2000.0 * sign, "acceleration"), values)
             for sign, values in ((1.0, rising), (-1.0, down))]  # fmt: skip
    run = run_of(parts, torque)
    assert inertia.inertias(run) == pytest.approx([330.0], rel=1e-4)
    worst, mean = inertia.evaluate(run)
    assert worst.value == pytest.approx(100.0 * (330.0 / (312.69 + 0.02242) - 1.0), abs=0.02)
    assert mean.what.endswith("793.2 kg at the rim")


def test_rise_and_settling_of_a_response_that_overshoots():
    """Dead time 60 ms, then 1.3 times the acceleration until 300 ms, then exactly it.

    Slopes are taken over 50 ms, so that an edge is seen within 25 ms of its place.
    """
    time = np.arange(0.0, 2.0, PERIOD)
    rate = np.where(time < 0.06, 0.0, np.where(time < 0.3, 1.3, 1.0)) * 0.5
    speed = 2.0 + np.cumsum(rate) * PERIOD
    step = pushed(1500.0, 750.0, "response")
    part = slice(0, len(time))
    rise, settling = response.rise_and_settling(run_of([(step, speed)]), step, part)
    assert rise == pytest.approx(0.07, abs=0.026)
    assert settling == pytest.approx(0.3, abs=0.03)


def test_a_missing_value_is_outside_and_the_page_names_its_check():
    good = Check(name="a", what="x", value=-1.0, unit="N", limit=1.0, source="s")
    shown = page([good, missing("b", "y", "%", 1.0, "s")])
    assert good.holds
    assert "missing" in shown
    assert shown.endswith("outside: b")


def test_shared_steps_are_driven_once_and_the_program_survives_its_document():
    config = Config()
    both = verification_program(config, ["inertia", "acceleration"], 2)
    assert both.steps == verification_program(config, ["acceleration"], 2).steps
    assert len([step for step in both.steps if step.label == "acceleration"]) == 2 * 2 * 3
    whole = config.with_program(verification_program(config, list(CHECKS)))
    assert from_document(whole.document) == whole


def test_a_speed_over_the_limit_is_refused_before_the_start():
    config = Config().with_values({"limits.speed_max_rpm": "3000"})
    assert verification_program(config, ["losses", "torque"]).steps[-2].speed < 315.0  # type: ignore[union-attr]
    with pytest.raises(ConfigError, match=r"limits\.speed_max_rpm.*3000.*at least 4377"):
        verification_program(config, ["coast-down"])


@pytest.mark.parametrize("key", ["rate_up_rpm_s", "rate_down_rpm_s"])
def test_a_slope_over_the_limit_is_refused_before_the_start(key):
    """0.75 m/s^2 are 0.75 / 0.645 * 62.6 * 60 / (2 pi) = 695 rpm/s at the motor."""
    config = Config().with_values({f"limits.{key}": "600"})
    with pytest.raises(ConfigError, match=rf"limits\.{key}.*slope.*600.*at least 695"):
        verification_program(config, ["acceleration"])
    assert verification_program(config, ["coast-down", "response"])


def test_a_run_that_shows_nothing_is_missing_in_every_check():
    run = run_of([(pushed(1000.0, 0.0, "nothing"), np.full(500, 1.0))])
    found = evaluate(run, list(CHECKS))
    assert {one.name for one in found} == set(CHECKS)
    assert not any(one.holds for one in found)


def slow_turn(*, torque: float = -4.0, ratio: float = RATIO, drift: float = 0.0) -> StepRun:
    """2 s of rest, 8 s at 300 rpm, 60 s at 2000 rpm with a drift of the torque per second."""
    program = readiness_program(60.0)
    turn, warm = (step for step in program.steps[1:3] if isinstance(step, Ramp))
    lengths = (200, 800, 6000)
    motor = np.repeat((0.0, turn.speed, warm.speed), lengths)
    time = np.arange(len(motor)) * PERIOD
    return StepRun(
        config=Config().with_program(program),
        trace=SweepTrace(
            name="test",
            time=time,
            motor_speed=motor,
            drum_speed=motor / ratio,
            shaft_torque=np.repeat((0.1, torque, 2.0 * torque), lengths) * (1.0 + drift * time),
        ),
        current=motor,
        own_time=time,
        heartbeat=np.arange(len(time), dtype=float),
        oil_temperature=np.full(len(time), np.nan),
        steps=np.repeat((0, 1, 2), lengths),
    )


def outside(run: StepRun) -> list[str]:
    return [one.name for one in ready(run) if not one.holds]


def test_a_bench_that_is_well_is_ready_with_its_tare():
    checks = ready(slow_turn())
    assert all(one.holds for one in checks)
    assert checks[0].value == pytest.approx(0.1)
    assert tuple(dict.fromkeys(one.name for one in checks)) == NAMES


@pytest.mark.parametrize(
    ("run", "names"),
    [
        (slow_turn(torque=4.0), ["sign"]),
        (slow_turn(ratio=62.8), ["ratio"]),
        (slow_turn(drift=-1.5e-4), ["warm-up"]),
    ],
    ids=["torque of the wrong sign", "ratio 0.3 % off", "friction falls by 0.9 % in a minute"],
)
def test_each_fault_is_found_by_the_check_that_is_meant_for_it(run, names):
    assert outside(run) == names
