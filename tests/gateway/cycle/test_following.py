"""A PLC that echoes the numbers of the commands and ignores their setpoint, or whose drive does.

3000 rpm/s are 314 rad/s^2, so that the reference is near within 2 rad/s and 12.57 rad/s. 400 rpm
are 41.89 rad/s, of which the motor may be away by 31.42 rad/s.
"""

import pytest

from gateway.configuration.config import Config
from gateway.cycle import following
from gateway.cycle.following import Following
from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from register_maps.signals import Measurement, Status
from tests.gateway.closed_loop import ClosedLoop

CONFIG = Config()


def sample(motor: float, reference: float | None) -> Measurement:
    return Measurement(
        sequence_start=7,
        sequence_end=7,
        plc_heartbeat=7,
        plc_time=1.0,
        status=Status.READY,
        motor_speed=motor,
        drum_speed=motor / 62.6,
        shaft_torque=0.0,
        speed_reference=reference,
    )


def noted(motor: float, reference: float | None, setpoint: float) -> Following:
    return following.note(
        CONFIG, Following(reference=1.0, motor=1.0), sample(motor, reference), setpoint, 2.0
    )


@pytest.mark.parametrize(
    ("reference", "near"), [(100.0, True), (114.5, True), (114.6, False), (85.4, False)]
)
def test_reference_is_near_within_what_it_moves_in_40_ms(reference: float, near: bool) -> None:
    assert noted(100.0, reference, 100.0).reference == (2.0 if near else 1.0)


@pytest.mark.parametrize(("motor", "near"), [(69.0, True), (68.0, False), (131.0, True)])
def test_motor_is_near_within_three_quarters_of_the_deviation(motor: float, near: bool) -> None:
    assert noted(motor, 100.0, 100.0).motor == (2.0 if near else 1.0)


def test_motor_is_compared_with_the_setpoint_where_the_map_has_no_reference() -> None:
    seen = noted(50.0, None, 100.0)
    assert (seen.reference, seen.motor) == (2.0, 1.0)


def test_no_new_sample_is_no_news() -> None:
    before = Following(reference=1.0, motor=1.0)
    assert following.note(CONFIG, before, None, 100.0, 2.0) is before


def test_reasons_come_when_the_times_are_over() -> None:
    assert following.reason(Following(reference=1.0, motor=1.0), 1.29) is None
    assert following.reason(Following(reference=1.0, motor=1.0), 1.31) is Reason.NOT_FOLLOWED
    assert following.reason(Following(reference=1.6, motor=1.11), 1.6) is None
    assert following.reason(Following(reference=1.6, motor=1.09), 1.6) is Reason.MOTOR_ASTRAY


class Deaf(ClosedLoop):
    """Its PLC takes every command and replaces the setpoint by zero."""

    def tick(self, measurement: Measurement) -> None:
        super().tick(measurement)
        if self.words is not None:
            words = list(self.words)
            words[4:6] = [0, 0]  # SPEED_REF, SPEED_RATE
            words[10:12] = [0, 0]  # CMD_CRC: not used
            self.words = words


def test_plc_that_ignores_the_setpoint_ends_the_run() -> None:
    """Nobody drives the drum, which the truck of 3640 kg tries to turn."""
    loop = Deaf(CONFIG)
    loop.start()
    for _ in range(600):
        loop.run(0.01)
        if loop.last.state is not State.RUN:
            break
    assert loop.last.reason is Reason.NOT_FOLLOWED
    fastest = max(one.setpoint.speed_setpoint for one in loop.outputs if one.setpoint)
    assert fastest < 41.89 + 1.0
