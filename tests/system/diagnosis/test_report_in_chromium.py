"""The report of a diagnosis in a real browser: Chromium, without a display."""

import hashlib
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from plant_emulator.diagnosis.report.document import from_json
from plant_emulator.diagnosis.report.html.page import html
from tests.plant_emulator.diagnosis import answers
from tests.system.diagnosis.conftest import FITTED, PREDICTED, Diagnosed

pytestmark = [pytest.mark.peer, pytest.mark.slow]

# What every element of a page measures, seen from a page that frames it 360 pixels wide.
NARROW = """<!DOCTYPE html><iframe src="report.html" width="360" height="800"
onload="document.body.dataset.wide = this.contentDocument.documentElement.scrollWidth"></iframe>"""
BROKEN = """<!DOCTYPE html><html><head><meta http-equiv="Content-Security-Policy"
content="default-src 'none'"/></head><body><svg><path d="M nan l"/></svg>
<img src="other.png"/></body></html>"""

ASKING = """<!DOCTYPE html><img src="http://127.0.0.1:9/asked.png">"""


@pytest.fixture
def chromium(require_program, tmp_path) -> Callable[..., tuple[str, list[str]]]:
    """Return a function: file and options -> the page as Chromium took it, console messages."""
    program = require_program("chromium")

    def run(page: Path, *options: str) -> tuple[str, list[str]]:
        done = subprocess.run(
            [
                program,
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--hide-scrollbars",
                "--enable-logging=stderr",
                "--v=0",
                f"--user-data-dir={tmp_path / 'profile'}",
                *options,
                page.as_uri(),
            ],
            capture_output=True,
            text=True,
            timeout=120,
            check=True,
        )
        return done.stdout, [row for row in done.stderr.splitlines() if ":CONSOLE" in row]

    return run


def written(folder: Path, kind: str) -> Path:
    page = folder / "report.html"
    page.write_text(html(from_json(answers.KINDS[kind]()), answers.DETAILS), encoding="utf-8")
    return page


def seen(picture: Path) -> np.ndarray:
    """The picture's pixels, shape (n, 3), 0 to 255."""
    return np.rint(255.0 * imread(picture)[..., :3]).astype(int).reshape(-1, 3)


def share(pixels: np.ndarray, colour: tuple[int, int, int], within: int = 3) -> float:
    return float(np.mean(np.abs(pixels - colour).max(axis=1) <= within))


def test_console_of_a_broken_page_is_heard(chromium, tmp_path):
    page = tmp_path / "broken.html"
    page.write_text(BROKEN, encoding="utf-8")
    _, console = chromium(page, "--dump-dom")
    assert any("Expected number" in row for row in console)
    assert any("Content Security Policy" in row for row in console)


@pytest.mark.parametrize("kind", answers.KINDS)
def test_chromium_takes_the_report_as_it_was_written_and_complains_of_nothing(
    chromium, tmp_path, kind
):
    page = written(tmp_path, kind)
    document, console = chromium(page, "--dump-dom")
    assert console == []
    for element in ("section", "table", "tr", "td", "figure", "svg", "path", "rect"):
        opened = rf"<{element}[ />]"
        assert len(re.findall(opened, document)) == len(re.findall(opened, page.read_text("utf-8")))
    assert answers.KINDS[kind]()["verdict"]["statement"] in document


@pytest.mark.parametrize("width", [1280, 500])
def test_screenshot_shows_text_bars_and_both_predictions(chromium, tmp_path, width):
    picture = tmp_path / "report.png"
    _, console = chromium(
        written(tmp_path, "effect"), f"--screenshot={picture}", f"--window-size={width},6000"
    )
    assert console == []
    pixels = seen(picture)
    assert share(pixels, (255, 255, 255)) > 0.5
    # Okabe and Ito's blue and vermillion: bars and curves; the ink of the text
    for ink in ((0, 114, 178), (213, 94, 0), (26, 26, 26)):
        assert share(pixels, ink, within=40) > 5e-4


def test_dark_screen_gets_a_dark_page(chromium, tmp_path):
    picture = tmp_path / "report.png"
    chromium(
        written(tmp_path, "effect"),
        f"--screenshot={picture}",
        "--window-size=1280,2000",
        "--blink-settings=preferredColorScheme=0",
    )
    assert share(seen(picture), (23, 25, 28)) > 0.5


def test_narrow_screen_scrolls_tables_and_pictures_never_the_page(chromium, tmp_path):
    written(tmp_path, "two_effects")
    frame = tmp_path / "frame.html"
    frame.write_text(NARROW, encoding="utf-8")
    document, _ = chromium(frame, "--dump-dom", "--allow-file-access-from-files")
    width = re.search(r'data-wide="(\d+)"', document)
    assert width is not None
    assert int(width[1]) <= 360


def test_print_is_a_few_pages_of_a4(chromium, tmp_path):
    pdf = tmp_path / "report.pdf"
    chromium(written(tmp_path, "effect"), f"--print-to-pdf={pdf}", "--no-pdf-header-footer")
    boxes = re.findall(rb"/MediaBox ?\[ ?0 0 ([\d.]+) ([\d.]+) ?\]", pdf.read_bytes())
    assert 3 <= len(boxes) <= 7
    # 210 mm by 297 mm in points
    assert {(round(float(w)), round(float(h))) for w, h in boxes} == {(595, 842)}


def asked(chromium: Callable[..., tuple[str, list[str]]], page: Path, folder: Path) -> list[str]:
    """What a page made the browser load; the browser's own calls home are not its."""
    log = folder / "net.json"
    chromium(page, "--dump-dom", f"--log-net-log={log}")
    loaded = r'"network_isolation_key":"file://.*?"url":"([^"]*)"'
    return re.findall(loaded, log.read_text(encoding="utf-8"))


def test_what_a_page_loads_is_heard(chromium, tmp_path):
    page = tmp_path / "asking.html"
    page.write_text(ASKING, encoding="utf-8")
    assert "http://127.0.0.1:9/asked.png" in asked(chromium, page, tmp_path)


def test_report_of_a_real_diagnosis_holds_all_and_loads_nothing(
    chromium, tmp_path, diagnosed: Diagnosed
):
    document, console = chromium(diagnosed.report, "--dump-dom")
    assert console == []
    assert asked(chromium, diagnosed.report, tmp_path) == []
    assert not re.search(r"<(script|link|img|iframe)\b", document)
    for title in (
        "How far the gap shrinks", "Where the gap lies", "Which effects were tested",
        "Parameter deviations", "What these logs cannot show",
        "Held-out runs: measured and predicted", "How to repeat this diagnosis",
    ):  # fmt: skip
        assert f"<h2>{title}</h2>" in document
    assert "with torque_sensor_lag" in re.search(r'aria-label="(Waterfall of[^"]*)', document)[1]
    for entry in diagnosed.answer["ranking"]:
        assert f"<code>{entry['effect']}</code>" in document
    for log in (*FITTED, PREDICTED):
        assert hashlib.sha256(Path(log).read_bytes()).hexdigest() in document
    assert f"plant-emulator diagnose {FITTED[0]}" in document


@pytest.mark.parametrize(("scheme", "paper"), [(1, (255, 255, 255)), (0, (23, 25, 28))])
def test_report_of_a_real_diagnosis_shows_both_predictions(
    chromium, tmp_path, diagnosed: Diagnosed, scheme, paper
):
    picture = tmp_path / "report.png"
    chromium(
        diagnosed.report,
        f"--screenshot={picture}",
        "--window-size=1280,6000",
        f"--blink-settings=preferredColorScheme={scheme}",
    )
    pixels = seen(picture)
    assert share(pixels, paper) > 0.5
    before, after = ((213, 94, 0), (0, 114, 178)) if scheme else ((240, 136, 58), (86, 180, 233))
    assert min(share(pixels, ink, within=40) for ink in (before, after)) > 5e-4


def test_report_of_a_real_diagnosis_prints_on_a_few_pages(chromium, tmp_path, diagnosed: Diagnosed):
    pdf = tmp_path / "report.pdf"
    chromium(diagnosed.report, f"--print-to-pdf={pdf}", "--no-pdf-header-footer")
    boxes = re.findall(rb"/MediaBox ?\[ ?0 0 ([\d.]+) ([\d.]+) ?\]", pdf.read_bytes())
    # Six pages and a half; another machine's fonts and longer paths may take one more.
    assert 3 <= len(boxes) <= 8
