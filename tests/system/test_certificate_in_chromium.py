"""The certificate in a real browser: Chromium takes it as written, and prints it on A4."""

import re
import subprocess

import pytest

from gateway.reports.certificate import html
from tests.gateway.workflows.test_certificate import DOCUMENT

pytestmark = [pytest.mark.peer, pytest.mark.slow]


def test_certificate_is_shown_without_complaint_and_printed_on_a4(require_program, tmp_path):
    page, pdf = tmp_path / "bench.html", tmp_path / "bench.pdf"
    page.write_text(html(DOCUMENT), encoding="utf-8")
    command = [
        *(require_program("chromium"), "--headless", "--no-sandbox", "--disable-gpu"),
        *("--enable-logging=stderr", "--v=0", f"--user-data-dir={tmp_path / 'profile'}"),
    ]
    for options in (["--dump-dom"], [f"--print-to-pdf={pdf}", "--no-pdf-header-footer"]):
        done = subprocess.run(
            [*command, *options, page.as_uri()],
            capture_output=True,
            text=True,
            timeout=120,
            check=True,
        )
        assert ":CONSOLE" not in done.stderr
        if options == ["--dump-dom"]:
            written = page.read_text("utf-8")
            for element in ("section", "table", "tr", "td"):
                opened = rf"<{element}[ >]"
                assert len(re.findall(opened, done.stdout)) >= len(re.findall(opened, written))
            assert "Outside: losses." in done.stdout
    boxes = re.findall(rb"/MediaBox ?\[ ?0 0 ([\d.]+) ([\d.]+) ?\]", pdf.read_bytes())
    assert 1 <= len(boxes) <= 2
    assert {(round(float(w)), round(float(h))) for w, h in boxes} == {(595, 842)}
