"""The closed loop that the tests of a tick begin with: idle, or driving in a run."""

import pytest

from tests.gateway.closed_loop import ClosedLoop
from tests.gateway.cycle.disturbances import CONFIG


@pytest.fixture
def idle():
    return ClosedLoop(CONFIG)


@pytest.fixture(scope="module")
def driving():
    loop = ClosedLoop(CONFIG)
    loop.start()
    loop.run(4.5)
    assert loop.last.setpoint.speed_setpoint > 50.0
    return loop


@pytest.fixture
def running(driving):
    return driving.branch()
