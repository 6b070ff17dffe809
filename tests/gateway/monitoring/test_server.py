"""Metrics, health and page over HTTP, asked by real clients."""

import json
import math
import socket
import sys
import time
import urllib.request
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

import gateway.cli
from gateway.cycle.record import Tick
from gateway.cycle.supervisor import State
from gateway.errors import ConfigError
from gateway.monitoring.block import BOUNDS
from gateway.monitoring.server import listen
from gateway.reasons import Reason
from tests.gateway.monitoring.test_block import good
from tests.gateway.monitoring.web import Web, serving
from tests.gateway.recordings.test_recorder import tick


@pytest.fixture
def web(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Web]:
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(tmp_path))
    with serving() as made:
        yield made


def test_prometheus_reads_the_metrics_and_finds_the_values_in_si(web: Web) -> None:
    web.publish(good(0, State.ARMED))
    web.publish(replace(good(1), latency=0.004))
    web.publish(replace(tick(2, read_back=False), state=State.RUN, fault=int(Reason.TIMEOUT)))
    web.publish(replace(good(3, State.RAMPDOWN, Reason.TIMEOUT), implausible=(0.25, 0.5, 0.0)))
    found = web.samples()
    assert found["gateway_info", "bench 1", "0.2.0"] == 1.0
    assert found["gateway_state", "RAMPDOWN"] == 1.0
    assert sum(value for (name, *_), value in found.items() if name == "gateway_state") == 1.0
    assert found["gateway_ticks_total",] == 4.0
    assert found["gateway_lost_total",] == 1.0
    assert found["gateway_trips_total",] == 1.0
    assert found["gateway_faults_total", "TIMEOUT"] == 1.0
    assert found["gateway_reasons_total", "TIMEOUT"] == 1.0
    assert found["gateway_plausibility_ratio", "motor"] == 0.25
    assert found["gateway_plausibility_ratio", "gear"] == 0.5
    assert found["gateway_motor_speed_radians_per_second",] == 0.1
    assert found["gateway_shaft_torque_newton_meters",] == -12.8
    assert math.isnan(found["gateway_armature_current_amperes",])
    assert 0.0 <= found["gateway_tick_age_seconds",] < 5.0


def test_alarm_has_its_first_time_and_stands_first_until_it_is_acknowledged(web: Web) -> None:
    trip = (good(0), good(1, State.RAMPDOWN, Reason.TIMEOUT), good(2, State.SAFE, Reason.TIMEOUT))
    begun = time.time()
    for one in trip:
        web.publish(one)
    found = web.samples()
    assert found["gateway_alarms_total", "TIMEOUT"] == 1.0
    assert found["gateway_alarm_active", "TIMEOUT"] == 1.0
    assert begun - 1.0 < found["gateway_alarm_first_seconds", "TIMEOUT"] < time.time() + 1.0
    web.publish(good(3, State.SHADOW))
    assert web.samples()["gateway_alarm_active", "TIMEOUT"] == 0.0
    for one in (good(4), good(5, State.RAMPDOWN, Reason.STALE)):
        web.publish(one)
    rows = json.loads(web.get("status.json")[1])["alarms"]
    assert [(row[0].partition(":")[0], row[1], row[-1]) for row in rows] == [
        ("STALE", "1 time", "not acknowledged"),
        ("TIMEOUT", "1 time", "acknowledged"),
    ]


def test_histogram_is_cumulative_and_ends_with_its_count(web: Web) -> None:
    for k, latency in enumerate((0.0004, 0.0004, 0.004, 3.0)):
        web.publish(replace(good(k), latency=latency))
    found = web.samples()
    name = "gateway_tick_latency_seconds"
    buckets = [v for (key, *_), v in found.items() if key == f"{name}_bucket"]
    assert len(buckets) == len(BOUNDS)
    assert buckets == sorted(buckets)
    assert found[f"{name}_bucket", "0.0005"] == 2.0
    assert found[f"{name}_bucket", "0.005"] == 3.0
    assert found[f"{name}_bucket", "+Inf"] == found[f"{name}_count",] == 4.0
    assert found[f"{name}_sum",] == pytest.approx(3.0048)


@pytest.mark.parametrize(
    ("made", "code"),
    [
        (good(0, State.ARMED), 200),
        (good(0, State.RUN), 200),
        (good(0, State.CONNECT, Reason.NOT_CONNECTED), 503),
        (good(0, State.SAFE, Reason.STALE), 503),
        (good(0, State.SAFE, Reason.REMOTE_OFF), 200),
    ],
)
def test_health_is_503_without_a_plc_and_after_a_trip(web: Web, made: Tick, code: int) -> None:
    web.publish(made)
    status, text = web.get("healthz")
    assert status == code
    assert json.loads(text)["state"] == State(made.state).name


def test_health_of_a_loop_that_stands_still_is_503(web: Web) -> None:
    web.publisher(replace(good(0), now=time.monotonic() - 3.0))
    status, text = web.get("healthz")
    assert status == 503
    assert json.loads(text)["tick_age"] >= 3.0


def test_page_is_one_file_that_names_no_other_place(web: Web) -> None:
    status, text = web.get("")
    assert status == 200
    assert "http" not in text
    assert web.get("other")[0] == 404
    with urllib.request.urlopen(web.url, timeout=10) as answer:
        assert answer.headers["Content-Security-Policy"].startswith("default-src 'none'")


def test_client_that_asks_nothing_keeps_no_other_from_its_answer(web: Web) -> None:
    web.publish(good(0))
    with socket.create_connection(web.server.server_address[:2], timeout=10):
        assert web.get("healthz")[0] == 200


@pytest.mark.parametrize("address", ["", "9108", "127.0.0.1", "127.0.0.1:nine", "127.0.0.1:70000"])
def test_address_that_is_none_is_refused_with_its_key(address: str) -> None:
    with pytest.raises(ConfigError, match=r"\[metrics\] address.*expected a free HOST:PORT"):
        listen(address)


def test_address_in_use_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    config = tmp_path / "bench.toml"
    config.write_text("[plc]\nport = 1\n")
    with listen("127.0.0.1:0") as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        run = ["run", "-c", str(config), "--metrics", address]
        result = CliRunner().invoke(gateway.cli.main, run)
    assert result.exit_code == 2
    assert result.stderr == (
        f"error: [metrics] address: Address already in use, found '{address}'; "
        "expected a free HOST:PORT, such as 127.0.0.1:9108\n"
    )


def test_missing_package_is_told_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "prometheus_client", None)
    config = tmp_path / "bench.toml"
    config.write_text('[plc]\nport = 1\n[metrics]\naddress = "127.0.0.1:0"\n')
    result = CliRunner().invoke(gateway.cli.main, ["run", "-c", str(config)])
    assert result.exit_code == 2
    assert "pip install 'road-load-bench[metrics]'" in result.stderr
