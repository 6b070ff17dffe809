"""Metrics of a running gateway for Prometheus, from one snapshot of the status block.

Names and units follow the conventions of Prometheus: base units, `_total` for counters. The extra
`metrics` brings prometheus_client.
"""

import time
from collections.abc import Iterator, Sequence
from math import isinf
from typing import TYPE_CHECKING, Final

from gateway.cycle.supervisor import State
from gateway.errors import ConfigError
from gateway.monitoring.block import BOUNDS, Snapshot
from gateway.monitoring.shared import Identity
from gateway.reasons import REASONS, Reason

if TYPE_CHECKING:
    from prometheus_client.metrics_core import HistogramMetricFamily, Metric

COUNTERS: Final = {
    "ticks": "Ticks of the loop",
    "lost": "Ticks without a good image of the PLC",
    "missed": "Deadlines that the loop missed",
    "dropped": "Records that the recorder did not get",
    "runs": "Entries into RUN",
    "trips": "Ends of a run that no operator asked for",
}
GAUGES: Final = {
    "age": ("sample_age_seconds", "Age of the newest sample"),
    "demand": ("demand_radians_per_second", "Demand of the regulator, motor"),
    "setpoint": ("setpoint_radians_per_second", "Setpoint of the motor"),
    "motor_speed": ("motor_speed_radians_per_second", "Measured speed of the motor"),
    "drum_speed": ("drum_speed_radians_per_second", "Measured speed of the drum"),
    "shaft_torque": ("shaft_torque_newton_meters", "Measured torque of the shaft"),
    "armature_current": ("armature_current_amperes", "Measured current of the armature"),
}
"""Field of the values -> name and help; a value that is not there is NaN."""


def require() -> None:
    """Raise ConfigError where prometheus_client is not installed."""
    try:
        import prometheus_client  # noqa: F401 - only whether it is there
    except ImportError as error:
        raise ConfigError(
            "prometheus_client is not installed",
            place="[metrics] address",
            expected="pip install 'road-load-bench[metrics]'",
        ) from error


def exposition(identity: Identity, snapshot: Snapshot, age: float) -> tuple[bytes, str]:
    """Metrics in the text format, and its content type; age : of the last tick [s]."""
    from prometheus_client import CollectorRegistry
    from prometheus_client.exposition import CONTENT_TYPE_LATEST, generate_latest
    from prometheus_client.registry import Collector

    class Once(Collector):
        """The metrics of this snapshot."""

        def collect(self) -> "Iterator[Metric]":
            yield from families(identity, snapshot, age)

    registry = CollectorRegistry(auto_describe=False)
    registry.register(Once())
    return generate_latest(registry), CONTENT_TYPE_LATEST


def families(identity: Identity, snapshot: Snapshot, age: float) -> "Iterator[Metric]":
    """The metrics of a snapshot; age : of the last tick [s]."""
    from prometheus_client.metrics_core import GaugeMetricFamily, InfoMetricFamily

    values = snapshot.values
    told = {"version": identity.version, "title": identity.title}
    yield InfoMetricFamily("gateway", "Version and PLC of the gateway", value=told)
    yield GaugeMetricFamily("gateway_tick_age_seconds", "Age of the last tick", value=age)
    for field, (name, text) in GAUGES.items():
        yield GaugeMetricFamily(f"gateway_{name}", text, value=getattr(values, field))
    yield from _counters(snapshot)
    yield from _alarms(snapshot, age)
    yield _states(snapshot)
    yield _relations(snapshot)
    yield _histogram(
        "latency", "From wake-up to the end of the write", snapshot.latency, values.latency_sum
    )
    yield _histogram("lateness", "From deadline to wake-up", snapshot.lateness, values.lateness_sum)


def _counters(snapshot: Snapshot) -> "Iterator[Metric]":
    from prometheus_client.metrics_core import CounterMetricFamily

    for field, text in COUNTERS.items():
        yield CounterMetricFamily(f"gateway_{field}", text, value=getattr(snapshot.values, field))
    for label, text, counts in (
        ("reason", "Changes to this reason of state", snapshot.reasons),
        ("fault", "Ticks with this fault", snapshot.faults),
    ):
        family = CounterMetricFamily(f"gateway_{label}s", text, labels=[label])
        for reason in Reason:
            family.add_metric([reason.name], counts[reason])
        yield family


def _alarms(snapshot: Snapshot, age: float) -> "Iterator[Metric]":
    """Alarms so far; age : of the last tick [s]."""
    from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily

    counts = CounterMetricFamily("gateway_alarms", "Trips by this reason", labels=["reason"])
    text = "Unix time of the first trip by this reason"
    first = GaugeMetricFamily("gateway_alarm_first_seconds", text, labels=["reason"])
    text = "1 until the operator acknowledges this alarm at the PLC"
    active = GaugeMetricFamily("gateway_alarm_active", text, labels=["reason"])
    offset = time.time() - age - snapshot.values.now
    for alarm in snapshot.alarms:
        name = [REASONS[alarm.reason].name]
        counts.add_metric(name, alarm.count)
        first.add_metric(name, offset + alarm.first)
        active.add_metric(name, float(not alarm.acknowledged))
    return iter((counts, first, active))


def _states(snapshot: Snapshot) -> "Metric":
    from prometheus_client.metrics_core import GaugeMetricFamily

    family = GaugeMetricFamily("gateway_state", "1 for the present state", labels=["state"])
    for state in State:
        family.add_metric([state.name], float(snapshot.values.state == state))
    return family


def _relations(snapshot: Snapshot) -> "Metric":
    from prometheus_client.metrics_core import GaugeMetricFamily

    text = "Sum of a relation between the sensors over its alarm level; a run ends above 1"
    family = GaugeMetricFamily("gateway_plausibility_ratio", text, labels=["relation"])
    for relation in ("motor", "gear", "drum"):
        family.add_metric([relation], getattr(snapshot.values, f"{relation}_share"))
    return family


def _histogram(
    name: str, text: str, counts: Sequence[int], total: float
) -> "HistogramMetricFamily":
    from prometheus_client.metrics_core import HistogramMetricFamily

    below = [sum(counts[: index + 1]) for index in range(len(counts))]
    buckets = [
        ("+Inf" if isinf(bound) else f"{bound:g}", count)
        for bound, count in zip(BOUNDS, below, strict=True)
    ]
    return HistogramMetricFamily(f"gateway_tick_{name}_seconds", text, buckets, total)
