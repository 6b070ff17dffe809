"""The web page of a running gateway in a real browser: Chromium, without a display."""

import re
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from gateway.cycle.supervisor import State
from gateway.reasons import Reason
from tests.gateway.monitoring.test_block import good
from tests.gateway.monitoring.web import Web, serving
from tests.gateway.recordings.test_recorder import MEASUREMENT

pytestmark = [pytest.mark.peer, pytest.mark.slow]


@pytest.fixture
def web(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Web]:
    """A gateway that has tripped; its motor turns at 955 rpm."""
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(tmp_path))
    with serving() as made:
        turning = replace(MEASUREMENT, motor_speed=100.0)
        made.publish(replace(good(0), measurement=turning))
        made.publish(replace(good(1, State.RAMPDOWN, Reason.STALE), measurement=turning))
        yield made


@pytest.fixture
def chromium(require_program, tmp_path) -> Callable[..., tuple[str, list[str]]]:
    """Return a function: address and options -> the page after some seconds, console messages."""
    program = require_program("chromium")

    def run(address: str, *options: str) -> tuple[str, list[str]]:
        done = subprocess.run(
            [
                *(program, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"),
                *("--enable-logging=stderr", "--v=0", "--virtual-time-budget=4000"),
                *(f"--user-data-dir={tmp_path / 'profile'}", *options, address),
            ],
            capture_output=True,
            text=True,
            timeout=120,
            check=True,
        )
        return done.stdout, [row for row in done.stderr.splitlines() if ":CONSOLE" in row]

    return run


def test_page_shows_state_values_trend_and_changes_and_complains_of_nothing(chromium, web) -> None:
    document, console = chromium(web.url, "--dump-dom")
    assert console == []
    shown = re.sub(r"<[^>]*>", " ", document.partition("<script>")[0])
    for part in ("bench 1", "RAMPDOWN for", "STALE: no fresh sample in time", "955", "-12.80 Nm"):
        assert part in shown
    assert re.search(r'id="motor_speed" points="[\d., ]+"', document)
    assert re.search(r'id="gone" role="alert" hidden', document)
    assert '<table id="status" class="warning">' in document
    for shown_section in ("alarmed", "counted"):
        assert f'<section id="{shown_section}">' in document
    assert re.search(r'id="alarms"><tr class="open">.*>not acknowledged<', document)
    assert "  RUN" in shown


def test_page_says_when_the_gateway_no_longer_answers(chromium, web, tmp_path) -> None:
    page = tmp_path / "page.html"
    page.write_text(web.get("")[1], encoding="utf-8")
    document, _ = chromium(page.as_uri(), "--dump-dom")
    assert not re.search(r'id="gone" role="alert" hidden', document)


@pytest.mark.parametrize(("scheme", "paper"), [(1, (255, 255, 255)), (0, (23, 25, 28))])
def test_page_is_drawn_on_light_and_dark_screens(chromium, web, tmp_path, scheme, paper) -> None:
    picture = tmp_path / "page.png"
    chromium(
        web.url,
        *(f"--screenshot={picture}", "--window-size=900,1100"),
        f"--blink-settings=preferredColorScheme={scheme}",
    )
    pixels = np.rint(255.0 * imread(picture)[..., :3]).reshape(-1, 3)
    assert np.mean(np.abs(pixels - paper).max(axis=1) <= 3) > 0.5
    line = (0, 114, 178) if scheme else (86, 180, 233)
    assert np.mean(np.abs(pixels - line).max(axis=1) <= 40) > 2e-4
