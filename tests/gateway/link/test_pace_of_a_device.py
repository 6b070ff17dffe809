"""`check --live` measures round trips: a tick takes two of them."""

import time

import pytest

from gateway.configuration.config import Config
from gateway.workflows.check import compare_pace
from register_maps import load
from tests.gateway.peer import Request, normal, peer

MAP = load("bench_int16")


@pytest.mark.parametrize(
    ("delay", "period", "severity"), [(0.008, 10, "error"), (0.0, 200, "info")]
)
def test_round_trips_that_the_period_cannot_hold_are_an_error(
    delay: float, period: int, severity: str
) -> None:
    def late(request: Request) -> bytes:
        time.sleep(delay)
        return normal(request)

    with peer(late) as running:
        config = Config().with_values({"plc.port": running.port, "loop.period_ms": float(period)})
        found = compare_pace(config, MAP)
    assert found.severity == severity
    assert "p50" in found.what
    assert "p99" in found.what


def test_device_that_does_not_answer_is_an_error() -> None:
    with peer(lambda _: None) as running:
        found = compare_pace(Config().with_values({"plc.port": running.port}), MAP)
    assert (found.severity, found.value) == ("error", "no reply")
