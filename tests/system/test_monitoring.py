"""A running gateway as a plant sees it: metrics over HTTP, and a terminal that stalls."""

import json
import os
import pty
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from prometheus_client.parser import text_string_to_metric_families

from gateway.recordings.recording import read
from plant_emulator.emulator.process import EmulatorProcess
from tests.system.gateway_process import CONFIG, gateway, until, until_armed

pytestmark = [pytest.mark.slow, pytest.mark.realtime]


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as found:
        return int(found.getsockname()[1])


def asked(port: int, path: str) -> tuple[int, str]:
    """Status and body; 0 where nobody answers."""
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/{path}", timeout=5) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read().decode()
    except OSError:
        return 0, ""


def test_metrics_and_health_follow_a_run_and_end_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(tmp_path))
    port = free_port()
    with EmulatorProcess(driver="none") as emulator:
        options = ("--metrics", f"127.0.0.1:{port}", "--log-format", "json")
        with gateway(tmp_path, emulator.port, *options) as daemon:
            until_armed(emulator)
            until(lambda: asked(port, "healthz")[0] == 200)
            emulator.set_remote(on=True)
            until(lambda: json.loads(asked(port, "healthz")[1])["state"] == "RUN")
            families = text_string_to_metric_families(asked(port, "metrics")[1])
            found = {sample.name: sample.value for one in families for sample in one.samples}
            emulator.stop()
            until(lambda: asked(port, "healthz")[0] == 503)
            watched = subprocess.run(
                [sys.executable, "-m", "gateway", "watch"],
                capture_output=True,
                text=True,
                check=True,
            )
            assert daemon.stop() == 1
    assert found["gateway_runs_total"] == 1.0
    assert found["gateway_ticks_total"] == pytest.approx(
        found["gateway_tick_latency_seconds_count"]
    )
    assert "1, 1 tripped" in watched.stdout
    assert asked(port, "healthz")[0] == 0
    lines = daemon.output.splitlines()
    events = [json.loads(line) for line in lines if line.startswith("{")]
    assert [event["state"] for event in events if event.get("state") == "RUN"] == ["RUN"]
    assert events[-1]["state"] == "OFF"


def test_terminal_that_takes_nothing_costs_no_record_and_not_the_end(tmp_path: Path) -> None:
    """Nobody reads the pseudo-terminal: after some kilobytes the kernel takes no more."""
    with EmulatorProcess(driver="none") as emulator:
        config = tmp_path / "gateway.toml"
        config.write_text(CONFIG.format(port=emulator.port, map="bench_int16"))
        master, terminal = pty.openpty()
        process = subprocess.Popen(
            [sys.executable, "-m", "gateway", "run", "-c", config],
            cwd=tmp_path,
            stdout=terminal,
            env={**os.environ, "TERM": "xterm"},
        )
        try:
            until_armed(emulator)
            (file,) = (tmp_path / "recordings").glob("*.rlrec")
            size = file.stat().st_size
            until(lambda: file.stat().st_size > size + 400 * 300)
            process.send_signal(signal.SIGTERM)
            assert process.wait(20) == 0
        finally:
            process.kill()
            process.wait()
            os.close(master)
            os.close(terminal)
    records = read(file).records
    assert records["dropped"].max() == 0
    assert records["tick"].tolist() == list(range(len(records)))
