"""The closed loop that the tests of the tick share."""

from gateway.configuration.config import Config
from tests.gateway.closed_loop import ClosedLoop


def test_branch_goes_on_as_its_loop_would_and_leaves_it_alone():
    loop = ClosedLoop(Config())
    loop.start()
    first, second = loop.branch(), loop.branch()
    first.run(3.0)
    for one in (second, loop):
        assert len(one.outputs) < len(first.outputs)
        one.run(3.0)
        assert one.outputs == first.outputs
        assert one.drum_speed == first.drum_speed
    assert first.drum_speed[-1] > 0.0
