"""The report: one file that stands alone, well-formed, escaped, small, readable, and right."""

import re
from collections import Counter
from dataclasses import replace
from itertools import product
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from plant_emulator.diagnosis.answer import Cell
from plant_emulator.diagnosis.prediction.trace import Trace
from plant_emulator.diagnosis.report.details import Step
from plant_emulator.diagnosis.report.document import from_json
from plant_emulator.diagnosis.report.html.page import MOST_RUNS, html
from plant_emulator.diagnosis.report.html.pictures import waterfall
from plant_emulator.diagnosis.report.html.style import STYLE
from plant_emulator.diagnosis.report.html.traces import path
from tests.plant_emulator.diagnosis import answers

HOSTILE = "<script>alert(1)</script>\"'&amp;]]>--><svg onload=x>\x1b[31m\x00\ud800\u202e"


def page(kind, details=answers.DETAILS) -> ET.Element:
    """The report, read by a strict parser."""
    return ET.fromstring(html(from_json(answers.KINDS[kind]()), details))


def words(element) -> str:
    return " ".join(" ".join(element.itertext()).split())


def section(root, title) -> ET.Element:
    [found] = [s for s in root.iter("section") if words(s.find("h2")) == title]
    return found


every_kind = pytest.mark.parametrize("kind", answers.KINDS)


@every_kind
def test_report_is_well_formed_and_says_what_it_is(kind):
    root = page(kind)
    assert root.get("lang") == "en"
    assert [words(h) for h in root.iter("h1")] == ["Sim-to-real gap"]
    assert words(root.find("head/title")).startswith("Sim-to-real gap: ")
    assert answers.KINDS[kind]()["verdict"]["statement"] in words(root.find("body/main/header"))


@every_kind
def test_every_picture_has_words_and_every_table_heads_and_a_caption(kind):
    root = page(kind)
    for drawn in root.iter("svg"):
        assert drawn.get("aria-hidden") == "true" or (
            drawn.get("role") == "img" and len(drawn.get("aria-label")) > 40
        )
    for table in root.iter("table"):
        assert words(table.find("caption"))
        assert all(h.get("scope") in {"col", "row"} for h in table.iter("th"))
        assert len({len(row) for row in table.iter("tr")}) == 1


@every_kind
def test_each_picture_and_each_table_stands_once(kind):
    root = page(kind)
    told = [s.get("aria-label") for s in root.iter("svg") if s.get("role") == "img"]
    captions = [words(c) for c in root.iter("caption")]
    curves = len(answers.KINDS[kind]().get("drafts", ()))
    assert len(told) == len(set(told)) == 1 + len(answers.CHANNELS) + curves
    assert len(captions) == len(set(captions))


@every_kind
def test_nothing_is_loaded_from_elsewhere(kind):
    text = html(from_json(answers.KINDS[kind]()), answers.DETAILS).lower()
    for reference in ("http:", "https:", "//", "src=", "href", "@import", "url(", "<script"):
        assert reference not in text
    assert "default-src 'none'" in text


def poisoned(value):
    """Answer with markup and control characters in every name."""
    if isinstance(value, dict):
        kept = {"schema", "kind"}
        return {k: v if k in kept else poisoned(v) for k, v in value.items()}
    if isinstance(value, list):
        return [poisoned(v) for v in value]
    return value + HOSTILE if isinstance(value, str) else value


@every_kind
def test_hostile_names_stay_text(kind):
    answer = poisoned(answers.KINDS[kind]())
    answer["gap"] = {
        key: {c + HOSTILE: v for c, v in value.items()} if isinstance(value, dict) else value
        for key, value in answer["gap"].items()
    }
    details = replace(
        answers.DETAILS,
        traces=tuple(
            replace(t, source=t.source + HOSTILE, channel=t.channel + HOSTILE, unit=HOSTILE)
            for t in answers.DETAILS.traces
        ),
        waterfall=tuple(replace(s, label=s.label + HOSTILE) for s in answers.DETAILS.waterfall),
        settings={k + HOSTILE: v + HOSTILE for k, v in answers.DETAILS.settings.items()},
        notes=tuple(n + HOSTILE for n in answers.DETAILS.notes),
    )
    text = html(from_json(answer), details)
    text.encode("utf-8")
    assert not re.search(r"[\x00-\x09\x0b-\x1f\x7f\u202e]", text)
    elements = Counter(e.tag for e in ET.fromstring(text).iter())
    usual = Counter(e.tag for e in page(kind).iter())
    assert set(elements) == set(usual)
    assert elements["svg"] == usual["svg"]
    assert elements["tr"] == usual["tr"]
    attributes = {key for e in ET.fromstring(text).iter() for key in e.attrib}
    assert not {key for key in attributes if key.startswith("on")}


def test_verdict_place_and_shrinkage_stand_first():
    head = words(page("effect").find("body/main/header"))
    for told in (
        "Effect found",
        "gear (81 % of the residual), armature current in field weakening: 1.25 A, noise 0.25 A",
        "98 % (95 % interval 96 % to 99 %)",
        "98 %: probability that it is right",
        "2 logs fitted, 1 log held out",
        "Next experiment: drive program1 in reverse from a cold start",
    ):
        assert told in head


def test_ranking_shows_intervals_of_two_normal_tails():
    rows = [words(r) for r in section(page("two_effects"), "Which effects were tested").iter("tr")]
    # 0.1013 -+ 1.96 * 0.0024 by hand
    assert rows[2].startswith("torque_sensor_lag torque sensor yes 214.2 18 %")
    assert "0.1013 \N{PLUS-MINUS SIGN} 0.0024 s (0.09660 to 0.1060)" in rows[2]
    assert rows[3].startswith("stribeck gear no 31.7 1 %")


def test_effects_that_cannot_be_told_apart_are_named():
    told = [
        words(li) for li in section(page("two_effects"), "Which effects were tested").iter("li")
    ]
    assert told[1] == (
        "torque_sensor_lag : these logs cannot distinguish it from shaft_damping , drum_speed_lag ."
    )


def test_parameter_deviation_shows_its_distance_from_the_set():
    row = [words(r) for r in section(page("parameter"), "Parameter deviations").iter("tr")][1]
    # (340.1 - 312.69) / 1.2 = 22.8; 340.1 / 312.69 = 1.0877
    expected = "drum_inertia 312.7 kg m^2 340.1 \N{PLUS-MINUS SIGN} 1.2 kg m^2 +8.8 % 23"
    assert row == expected


def test_map_frames_the_named_place_and_no_other():
    framed = [c for c in page("effect").iter("td") if "here" in c.get("class", "").split()]
    assert [words(c) for c in framed] == ["5.0 \N{MULTIPLICATION SIGN} 1.25 A"]
    assert not [c for c in page("none").iter("td") if "here" in c.get("class", "").split()]


def test_residual_is_mapped_along_every_axis():
    cells = [
        ("armature_current", "speed", "0 to 25 rad/s", 0.5),
        ("armature_current", "speed", "25 to 50 rad/s", 1.0),
        ("shaft_torque", "direction", "backward", 0.3),
    ]
    others = [Cell(channel=c, axis=a, bin=b, gap=gap, noise=0.25) for c, a, b, gap in cells]
    answer = from_json(answers.effect())
    location = replace(answer.location, cells=(*answer.location.cells, *others))
    found = ET.fromstring(html(replace(answer, location=location), answers.DETAILS))
    tables = {words(t.find("caption")): t for t in found.iter("table") if t.get("class") == "map"}
    assert len(tables) == 3
    rows = [
        words(r) for r in tables["Residual without effects by channel and motor speed."].iter("tr")
    ]
    times = "\N{MULTIPLICATION SIGN}"
    assert rows == [
        "channel 0 to 25 rad/s 25 to 50 rad/s",
        f"armature current 2.0 {times} 0.500 A 4.0 {times} 1.00 A",
    ]
    rows = [
        words(r) for r in tables["Residual without effects by channel and direction."].iter("tr")
    ]
    assert rows == ["channel backward", f"shaft torque 1.2 {times} 0.300 N m"]


def test_what_is_null_is_told_as_not_known_and_never_as_none_or_nan():
    for kind in answers.KINDS:
        told = words(page(kind).find("body"))
        assert not re.search(r"\b(None|nan|null)\b[^ ]", told)
    row = words(section(page("unknown"), "Which effects were tested").find(".//tbody/tr"))
    assert row == "stribeck gear no 31.7 not computed rise 12.00 \N{PLUS-MINUS SIGN} not known N m"


def test_settings_hashes_and_notes_are_there_to_repeat_it():
    told = words(section(page("none"), "How to repeat this diagnosis"))
    for text in (*answers.DETAILS.settings.values(), *answers.DETAILS.notes):
        assert text in told
    assert "Held out program3.csv.gz" in told


def offset(channel="armature_current", source="a.csv", samples=500) -> Trace:
    """Predicted 2 A too low before, 0.5 A after."""
    time = np.linspace(0.0, 10.0, samples)
    measured = 10.0 * np.sin(time)
    return Trace(
        source=source,
        channel=channel,
        unit="A",
        time=time,
        measured=measured,
        recalibrated=measured - 2.0,
        explained=measured - 0.5,
        noise=0.25,
    )


def test_run_tells_its_residual_before_and_after_in_the_channels_unit():
    root = page("effect", answers.with_traces(offset()))
    told = "rms of the residual 2.00 A before, 0.500 A after; noise 0.25 A"
    assert told in words(root.find(".//figcaption[strong]"))
    row = [words(r) for r in section(root, "How far the gap shrinks").iter("tr")][3]
    assert row == "armature current 6.100 3.400 0.900 0.800 2.00 A 0.500 A 0.25 A"


def test_run_without_an_effect_shows_one_prediction():
    trace = offset()
    root = page("unknown", answers.with_traces(replace(trace, explained=trace.recalibrated)))
    assert not [e for e in root.iter("path") if "after" in e.get("class")]
    assert "rms of the residual 2.00 A; noise" in words(root)


def test_bar_of_four_noises_is_twice_as_long_as_one_of_two():
    steps = [Step(label=str(g), gap=g, low=0.9 * g, high=1.1 * g) for g in (4.0, 2.0)]
    bars = [r for r in waterfall_of(steps).iter("rect") if r.get("class") == "left"]
    four, two = (float(r.get("width")) for r in bars)
    assert four == pytest.approx(2.0 * two, abs=0.02)


def waterfall_of(steps) -> ET.Element:
    return ET.fromstring(waterfall(steps))


def test_noise_floor_of_the_waterfall_is_a_line_not_a_step():
    drawn = waterfall_of(answers.DETAILS.waterfall)
    assert len([r for r in drawn.iter("rect") if r.get("class") == "left"]) == 3
    assert [t.text for t in drawn.iter("text")].count("noise floor") == 1


def points(d: str) -> np.ndarray:
    """Corners of a path of one piece."""
    start, _, steps = d.removeprefix("M").partition("l")
    first = np.array(start.split(), float)
    return first + np.vstack(
        [[0.0, 0.0], np.cumsum(np.array(steps.split(), float).reshape(-1, 2), 0)]
    )


def test_thinned_curve_keeps_a_spike_of_one_sample():
    x, y = np.linspace(60.0, 748.0, 100_000), np.full(100_000, 40.0)
    y[61_803] = 3.0
    corners = points(path(x, y, 300))
    assert len(corners) < 1300
    assert corners[:, 1].min() == pytest.approx(3.0, abs=0.1)
    assert corners[-1] == pytest.approx([748.0, 40.0], abs=0.1)


def test_curve_is_broken_where_a_sample_is_not_finite():
    y = np.arange(10.0)
    y[4] = np.nan
    assert path(np.arange(10.0), y, 300).count("M") == 2
    assert "nan" not in path(np.arange(10.0), y, 300)


def test_sample_between_two_that_are_not_drawn_is_a_dot():
    """A line to of SVG needs a pair of numbers."""
    alone = np.array([np.nan, 2.0, np.nan])
    assert path(np.arange(3.0), alone, 300) == "M1 2l0 0"


def rough(trace: Trace, name: str) -> Trace:
    """The trace with predictions as noisy as the measurement, which thin out least."""
    noise = trace.noise * np.random.default_rng(5).standard_normal((2, len(trace.time)))
    before, after = trace.recalibrated + noise[0], trace.explained + noise[1]
    return replace(trace, channel=name, recalibrated=before, explained=after)


def test_report_of_many_long_runs_stays_small_and_names_what_it_leaves_out():
    runs = [
        rough(trace, f"{trace.channel}{twin}")
        for k in range(12)
        for trace in answers.traces(f"run_{k:02}.csv", samples=5_000)
        for twin in ("", "_again")
    ]
    text = html(from_json(answers.effect()), answers.with_traces(*runs))
    assert len(text.encode()) < 2e6
    left_out = re.search(r"Not drawn, with smaller gaps: ([^<]*)\.<", text)
    assert left_out is not None
    assert len(left_out[1].split(", ")) == 12 - MOST_RUNS


def colours(block: str) -> dict[str, str]:
    return dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})\b", block))


def luminance(colour: str) -> float:
    """Relative luminance (WCAG 2.1)."""
    parts = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(a: str, b: str) -> float:
    light, dark = sorted((luminance(a), luminance(b)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def test_text_can_be_read_on_every_ground_of_light_and_dark_screens():
    light, dark = (colours(block) for block in STYLE.split("@media screen", 1))
    for screen in (light, light | dark):
        for ink, ground in product(("fore", "soft"), ("back", "panel", "heat1")):
            assert contrast(screen[ink], screen[ground]) >= 4.5, (ink, ground)
        for ground in ("heat2", "heat3"):
            assert contrast(screen["fore"], screen[ground]) >= 4.5, ground
        assert contrast(screen["heat4-fore"], screen["heat4"]) >= 4.5
        for curve in ("before", "after"):
            assert contrast(screen[curve], screen["back"]) >= 3.0


def test_search_and_noise_stand_in_tables() -> None:
    found = words(section(page("effect"), "How the answer was found"))
    assert "confirmed gear_oil_temperature" in found
    assert "380 (simulation), 402 (relations)" in found
    assert "50.02 Hz, 100.04 Hz" in found
    assert "30 ms" in found


TITLE = "The missing law, drafted"


def test_draft_is_drawn_with_its_curve_band_law_and_alternatives():
    found = section(page("drafted"), TITLE)
    best, other = found.findall("figure")
    assert [p.get("class") for p in best.iter("path")] == ["after", "edge", "edge", "before"]
    assert [p.get("class") for p in other.iter("path")] == ["after", "edge", "edge"]
    assert "alternatives: -8.2 sqrt(w) N m" in words(found)
    assert "drafts/draft_gear_1.py" in words(found)


def test_draft_is_followed_by_the_channel_that_it_changes_most():
    changed = answers.traces(source="held_out.csv")
    found = section(page("drafted", replace(answers.DETAILS, draft_traces=changed)), TITLE)
    curve, change, _ = found.findall("figure")
    told = [s.get("aria-label") for s in change.iter("svg")]
    # the offset is 0.02 of each signal's largest value, and the noise 0.004 of it
    assert len(told) == 1
    assert "held_out.csv over time, measured and predicted" in told[0]
    assert "after" in {p.get("class") for p in change.iter("path")}
    assert len(curve.findall("figcaption")) == 1
