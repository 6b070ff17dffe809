"""The false alarms of many hours are counted with the daemon's own sums."""

import numpy as np
import pytest

from gateway.configuration.config import Config
from tests.gateway.closed_loop import ClosedLoop
from tests.gateway.drifted_bench import largest_shares
from tests.gateway.false_alarms import SIGMA, drive, shares


@pytest.mark.slow
def test_sums_of_many_draws_are_those_of_the_daemon(monkeypatch: pytest.MonkeyPatch) -> None:
    """A truck sets off and brakes on the nominal bench, without noise."""
    for name in SIGMA:
        monkeypatch.setitem(SIGMA, name, 0.0)
    first, second = ClosedLoop(Config()), ClosedLoop(Config())
    first.start()
    second.start()
    theirs = largest_shares(first, 12.0)
    ours = shares(second.state.watched.relations, drive(second, 12.0), 2, 1)
    assert ours[0] == pytest.approx(ours[1])
    assert np.all(theirs[:2] > 0.01)
    assert ours[0] == pytest.approx(theirs, rel=0.02)
