"""A certificate binds what it says to its files: a changed recording, set or page is noticed."""

import hashlib
import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gateway.cli import main
from gateway.reports.certificate import document_in, html, is_written
from tests.gateway.cli.test_ready_and_verify import recorded

CHECK = {"name": "losses", "what": "a <worst> & b", "value": 9.5, "unit": "N", "limit": 9.0}
RUN = {
    "files": {"verify.rlrec": "0" * 64},
    "run": "verification",
    "date": "2026-11-23T10:00:00+00:00",
    "plc": "192.0.2.1:502, unit 1",
    "config_sha256": "1" * 64,
    "gateway": "0.2.0",
    "truck": {"mass_kg": 3640.0, "load_kg": 0.0},
    "checks": [{**CHECK, "source": "own </script> limit", "holds": False}],
    "budget": None,
    "j2951": None,
}
ERRORS = {"force_newton": 1.25, "energy_percent": -0.5, "speed_km_h": 0.125}
BUDGET = {"causes": [{"cause": "dead time", **ERRORS}], "interaction": ERRORS, "left": ERRORS}
JUDGED = {"judged_seconds": 9.8, "duration_seconds": 30.0, "whole": ERRORS, "largest": "x"}
TRUCK = {"run": "road load", "checks": [], "budget": {**BUDGET, **JUDGED}}
DOCUMENT = {
    "schema": "certificate/1",
    "date": "2026-11-23T12:00:00+00:00",
    "program": "gateway 0.2.0",
    "holds": False,
    "not_shown": [],
    "bench": {"drum_radius_m": 0.645},
    "map": {"name": "bench_int16", "sha256": "2" * 64},
    "parameters": {"set": "set.toml", "sha256": "3" * 64, "origin": {"a": 1}, "effects": ["lag"]},
    "runs": [RUN, {**RUN, **TRUCK, "j2951": {"iwr_percent": -0.4}}],
}


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["certificate", *map(str, arguments)])


def test_the_page_holds_its_document_and_a_changed_word_on_it_is_noticed():
    page = html(DOCUMENT)
    assert document_in(page) == DOCUMENT
    assert page.count("</script>") == 1
    assert "against the road, first 9.8 of 30.0 s" in page
    assert is_written(page, DOCUMENT)
    assert not is_written(page.replace("<td>losses</td>", "<td>torque</td>"), DOCUMENT)
    assert is_written(json.dumps(DOCUMENT), DOCUMENT)


@pytest.mark.parametrize(
    ("value", "shown"),
    [(1205.0, "+1205"), (-545.25, "-545.2"), (-0.0004, "-0.000")],
)
def test_a_value_has_four_digits_and_at_most_three_decimals(value, shown):
    check = {**CHECK, "value": value, "source": "own", "holds": False}
    page = html({**DOCUMENT, "runs": [{**RUN, "checks": [check]}]})
    assert f'<td class="number">{shown}</td><td class="number">9</td>' in page


def test_checks_that_no_recording_shows_are_named_and_nothing_is_certified(tmp_path):
    """A bench whose tare, ratio or coast-downs nobody has seen is not to be believed."""
    page = html({**DOCUMENT, "not_shown": ["tare", "coast-down"]})
    shown = "Outside: losses. Not shown by these recordings: tare, coast-down."
    assert f'<p class="fails">{shown}</p>' in page


def test_the_page_shows_values_limits_digests_and_what_lies_outside():
    page = html(DOCUMENT)
    assert '<p class="fails">Outside: losses.</p>' in page
    for cell in ("a &lt;worst&gt; &amp; b", "own &lt;/script&gt; limit", "lag", "dead time"):
        assert f"<td>{cell}</td>" in page
    assert '<td class="number">+9.500</td><td class="number">9</td><td>N</td>' in page
    assert "<td>inertia work rating IWR [%]; for comparison -2 .. +4, second-hand</td>" in page
    assert '<td class="outside">OUTSIDE</td>' in page
    assert f"sha256 {'0' * 64}" in page
    assert "192.0.2.1:502, unit 1</td>" in page


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "expected recordings, or --verify FILE"),
        (["a.rlrec", "--verify", "c.html"], "expected recordings, or --verify FILE"),
        (["a.rlrec"], "expected --save FILE or --json FILE"),
        (["a.rlrec", "--json", "-"], "a.rlrec: No such file"),
        (["--verify", "none.html"], "none.html: No such file"),
        (["--verify", "other.html"], "other.html: no certificate"),
        (["--verify", "half.json"], "half.json: no certificate"),
        (["--verify", "empty.json"], "empty.json: no certificate"),
        (["--verify", "deep.json"], "deep.json: no certificate"),
    ],
)
def test_wrong_use_is_one_line_and_exit_code_2(tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    Path("other.html").write_text("<html></html>")
    Path("half.json").write_text('{"schema": "certificate/1", "runs": []}')
    Path("empty.json").write_text(json.dumps({**DOCUMENT, "parameters": {}}))
    Path("deep.json").write_text(100_000 * "[")
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    assert says in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.slow
def test_what_follows_from_the_recordings_is_verified_and_a_change_is_not(tmp_path):
    folder = tmp_path / "made"
    folder.mkdir()
    path, page = recorded(folder, ["losses", "torque"]), folder / "bench.html"
    made = run(path, "--save", page)
    assert (made.exit_code, made.stdout) == (1, f"not certified: see {page}\n")
    told = document_in(page.read_text("utf-8"))
    ready = ["tare", "zero", "sign", "ratio", "warm-up", "heartbeat", "clock"]
    others = ["inertia", "acceleration", "compensation", "coast-down", "response"]
    assert told["not_shown"] == ready + others
    assert [one["name"] for one in told["runs"][0]["checks"]] == ["losses", "torque"]
    assert told["runs"][0]["files"] == {path.name: hashlib.sha256(path.read_bytes()).hexdigest()}

    moved = tmp_path / "moved"
    shutil.move(folder, moved)
    page, path = moved / page.name, moved / path.name
    agreed = run("--verify", page)
    assert (agreed.exit_code, agreed.stdout) == (0, "the certificate agrees with its files\n")

    told["runs"][0]["checks"][0]["value"] += 0.1
    forged = moved / "forged.html"
    forged.write_text(html(told), encoding="utf-8")
    result = run("--verify", forged)
    assert result.exit_code == 1
    assert result.stdout.startswith("runs[0].checks[0].value: ")

    content = bytearray(path.read_bytes())
    content[-100] ^= 1
    path.write_bytes(content)
    result = run("--verify", page)
    assert result.exit_code == 1
    assert result.stdout == f"{path}: changed since the certificate was made\n"
    path.unlink()
    assert run("--verify", page).stdout == f"{path}: missing\n"
